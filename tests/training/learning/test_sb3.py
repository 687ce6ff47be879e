"""Learners as a vector environment of Stable-Baselines3."""

from __future__ import annotations

import pickle
import warnings
from typing import Any

import numpy as np
import pytest
from learner_runs import HORIZON, drawn

from trust_env.training.learning.gym import AdversaryEnv

pytestmark = pytest.mark.core


@pytest.mark.extra("train")
@pytest.mark.parametrize("wrapper", ["raw", "phantoms", "grid", "by_need"])
def test_adversary_env_passes_stable_baselines_checker(wrapper: str) -> None:
    from stable_baselines3.common.env_checker import check_env as check_for_sb3

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_for_sb3(AdversaryEnv("trio", wrapper=wrapper))


@pytest.mark.extra("train")
def test_vec_env_reports_what_stable_baselines_needs() -> None:
    from stable_baselines3.common.vec_env import VecMonitor

    from trust_env.training.learning.sb3 import LearnersVecEnv

    env = LearnersVecEnv("trio", "score", num_worlds=3, max_cycles=HORIZON, stagger=True)
    monitored = VecMonitor(LearnersVecEnv("trio", "score", num_worlds=3, max_cycles=HORIZON, stagger=True))
    env.seed(6)
    monitored.seed(6)
    np.testing.assert_array_equal(env.reset(), monitored.reset())
    returns, lengths = np.zeros(3), np.zeros(3, dtype=int)
    for frame in range(2 * HORIZON):
        choices = drawn(env.learners, frame)
        seen, rewards, dones, infos = env.step(choices)
        same, _, _, theirs = monitored.step(choices)
        np.testing.assert_array_equal(seen, same)
        returns, lengths = returns + rewards, lengths + 1
        for i in range(3):
            assert bool(infos[i]) == dones[i]
            if dones[i]:
                assert infos[i]["TimeLimit.truncated"] is True
                assert infos[i]["terminal_observation"] in env.observation_space
                assert (infos[i]["terminal_observation"] != seen[i]).any()
                assert infos[i]["episode"]["r"] == pytest.approx(returns[i])
                assert infos[i]["episode"]["l"] == theirs[i]["episode"]["l"] == lengths[i]
                assert infos[i]["episode"]["r"] == pytest.approx(theirs[i]["episode"]["r"])
        returns[dones], lengths[dones] = 0.0, 0
    assert env.get_attr("render_mode") == [None] * 3 and env.get_attr("num_worlds", [0]) == [3]
    assert env.metrics["false_tracks"].shape == (3,)


@pytest.mark.extra("train")
def test_a_vec_env_snapshot_continues_its_episode_statistics() -> None:
    from trust_env.training.learning.sb3 import LearnersVecEnv

    def ended(env: LearnersVecEnv) -> list[Any]:
        frames = [env.step(drawn(env.learners, frame))[3] for frame in range(10)]
        return [info.get("episode") for infos in frames for info in infos]

    env, fresh = (LearnersVecEnv("trio", num_worlds=2, max_cycles=8) for _ in range(2))
    env.seed(1)
    env.reset()
    for frame in range(5):
        env.step(drawn(env.learners, frame))
    fresh.set_state(pickle.loads(pickle.dumps(env.get_state())))
    np.testing.assert_array_equal(fresh.learners.observe(), env.learners.observe())
    episodes = ended(env)
    assert episodes == ended(fresh) and sum(e is not None for e in episodes) == 2


@pytest.mark.extra("train")
def test_values_are_bootstrapped_at_the_horizon() -> None:
    """Rewards that are 1 in every frame: at the horizon the buffer holds 1 + gamma V(final observation)."""
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecEnvWrapper

    from trust_env.training.learning.sb3 import LearnersVecEnv

    class Constant(VecEnvWrapper):
        final: dict[tuple[int, int], np.ndarray]

        def reset(self) -> Any:
            self.final, self.frame = {}, 0
            return self.venv.reset()

        def step_wait(self) -> Any:
            seen, rewards, dones, infos = self.venv.step_wait()
            self.final |= {(self.frame, i): infos[i]["terminal_observation"] for i in np.flatnonzero(dones).tolist()}
            self.frame += 1
            return seen, np.ones_like(rewards), dones, infos

    env = Constant(LearnersVecEnv("trio", num_worlds=4, max_cycles=HORIZON, stagger=True))
    model = PPO("MlpPolicy", env, n_steps=10, batch_size=40, n_epochs=1, gamma=0.9, learning_rate=0.0, seed=0)
    model.learn(40)
    expected = np.ones((10, 4), dtype=np.float32)
    with torch.no_grad():
        for (frame, i), final in env.final.items():
            expected[frame, i] += 0.9 * model.policy.predict_values(torch.as_tensor(final[None])).item()
    assert sorted(frame for frame, _ in env.final) == [
        1,
        2,
        4,
        5,
        7,
        8,
    ]
    np.testing.assert_allclose(model.rollout_buffer.rewards, expected, rtol=1e-5)


@pytest.mark.extra("train")
@pytest.mark.parametrize("wrapper", ["phantoms", "grid", "by_need"])
def test_ppo_learns_behind_the_usual_wrappers(wrapper: str) -> None:
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

    from trust_env.training.learning.sb3 import LearnersVecEnv

    env = VecNormalize(VecMonitor(LearnersVecEnv("trio", num_worlds=4, wrapper=wrapper, max_cycles=8)))
    model = PPO("MlpPolicy", env, n_steps=16, batch_size=32, n_epochs=2, seed=0)
    before = {name: value.clone() for name, value in model.policy.state_dict().items()}
    model.learn(128)
    assert any((value != before[name]).any() for name, value in model.policy.state_dict().items())
    assert model.ep_info_buffer is not None and {e["l"] for e in model.ep_info_buffer} == {8}
    copied = pickle.loads(pickle.dumps(env))
    copied.set_venv(env.venv)
    np.testing.assert_array_equal(copied.obs_rms.mean, env.obs_rms.mean)
