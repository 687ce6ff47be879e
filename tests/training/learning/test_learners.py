"""Learners: the same frames as the environment itself, and what Stable-Baselines3 and Gymnasium ask for."""

from __future__ import annotations

import copy
import pickle
import sys
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import RecordEpisodeStatistics

from trust_env.agents import Player
from trust_env.training.learning.gym import AdversaryEnv, GymVectorEnv
from trust_env.training.learning.learners import Learners
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core

HORIZON = 6


def drawn(learners: Any, seed: int) -> np.ndarray:
    """Choices of every learner, uniform in the action space."""
    space = copy.deepcopy(learners.action_space)
    space.seed(seed)
    return np.array([space.sample() for _ in range(learners.num_learners)])


def play(learners: Learners, frames: int, first: int = 0) -> list[tuple[Any, ...]]:
    """Observations, rewards and ends of some frames of random choices."""
    return [learners.step(drawn(learners, first + frame))[:3] for frame in range(frames)]


def assert_same(these: list[tuple[Any, ...]], those: list[tuple[Any, ...]]) -> None:
    for one, other in zip(these, those, strict=True):
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a, b)


# --- against the environment itself ---


@pytest.mark.parametrize("others", [{}, {"benign": "random", "adversary_1": "false_positive(n=2)"}])
def test_learners_are_the_environment_with_raw_actions(others: dict[str, Any]) -> None:
    """Driven by hand: a `VectorEnv` with autoreset, and a `Player` for the agents that do not learn."""
    role, agents = ("adversary_0", [0]) if others else ("adversary", [0, 1])
    learners = Learners("patrol", "trust", 3, "raw", others, max_cycles=HORIZON, learner_role=role)
    env = VectorEnv("patrol", "trust", 3, max_cycles=HORIZON)
    player, observations = Player(env, others), env.reset(5)[0]
    seen = learners.reset(5)
    assert learners.num_learners == 3 * len(agents)
    for frame in range(2 * HORIZON + 3):
        np.testing.assert_array_equal(seen, observations[:, agents].reshape(len(seen), -1))
        choices, actions = drawn(learners, frame), player.actions(observations)
        actions[:, agents] = choices.reshape(3, len(agents), -1)
        seen, rewards, ended, info = learners.step(choices)
        observations, paid, _, truncated, expected = env.step(actions)
        np.testing.assert_array_equal(rewards, paid[:, agents].astype(np.float32).reshape(-1))
        np.testing.assert_array_equal(ended, np.repeat(truncated, len(agents)))
        np.testing.assert_array_equal(info["metrics"]["false_tracks"], expected["false_tracks"])
        assert ("final_obs" in info) == ("final_obs" in expected) == bool((frame + 1) % HORIZON == 0)
        if "final_obs" in info:
            final = expected["final_obs"][:, agents].reshape(len(seen), -1)
            np.testing.assert_array_equal(info["final_obs"], final)


def test_final_observations_show_what_the_view_held_at_the_end() -> None:
    learners = Learners("trio", "score", 2, "phantoms", max_cycles=HORIZON)
    to_the_end = Learners("trio", "score", 2, "phantoms", max_cycles=HORIZON, autoreset=False)
    learners.reset(1)
    to_the_end.reset(1)
    for frame in range(HORIZON):
        seen, _, ended, info = learners.step(drawn(learners, frame))
        final, _, over, _ = to_the_end.step(drawn(learners, frame))
    assert ended.all() and over.all()
    np.testing.assert_array_equal(info["final_obs"], final)
    assert np.abs(final[:, -6:]).max() > 0.0  # phantoms at the end of the episode,
    np.testing.assert_array_equal(seen[:, -6:], 0.0)  # none at the beginning of the next
    with pytest.raises(RuntimeError, match="the episodes are over"):
        to_the_end.step(drawn(learners, 0))


def test_staggered_worlds_end_by_turns_and_then_live_as_long_as_the_others() -> None:
    learners = Learners("trio", "score", 4, max_cycles=8, stagger=True)
    for _ in range(2):
        learners.reset(3)
        ends = np.array([ended for _, _, ended in play(learners, 24)])
        frames = [np.flatnonzero(ends[:, w]) + 1 for w in range(4)]
        np.testing.assert_array_equal(frames, [[2, 10, 18], [4, 12, 20], [6, 14, 22], [8, 16, 24]])


def test_benign_agents_can_learn_and_are_paid_the_opposite() -> None:
    adversaries = Learners("patrol", "score", 2, "raw")
    benign = Learners("patrol", "score", 2, "raw", learner_role="benign")
    adversaries.reset(0)
    benign.reset(0)
    assert benign.num_learners == 6
    for _ in range(10):
        _, gains, _, _ = adversaries.step(np.zeros((4, 28)))
        _, losses, _, _ = benign.step(np.zeros((6, 28)))
        np.testing.assert_allclose(
            losses.reshape(2, 3), -gains.reshape(2, 2).mean(axis=1)[:, None].repeat(3, 1)
        )


def test_a_seed_gives_the_same_episodes_and_the_next_reset_other_ones() -> None:
    learners = Learners("trio", "trust", 3)
    first, played = learners.reset(11), play(learners, 5)
    following = learners.reset()
    assert (first != following).any()
    np.testing.assert_array_equal(learners.reset(11), first)
    assert_same(play(learners, 5), played)


# --- snapshots ---


class Remembering:
    """A user's own defense with memory: it publishes every other frame."""

    def reset(self, shape: Any, worlds: np.ndarray) -> None:
        self.shape, self.frames = shape, 0

    def update(self, evidence: Any) -> Any:
        from trust_env.defenses import Verdict

        self.frames += 1
        return Verdict(publish=np.full(evidence.status.shape, self.frames % 2 == 0))


@pytest.mark.parametrize(
    ("defense", "others", "role"),
    [
        ("trust", {}, "adversary"),
        ("trust", {"adversary_1": "false_positive(motion=random_walk)", "benign": "suppress"}, "adversary_0"),
        (Remembering, {"benign": "random"}, "adversary"),
    ],
)
@pytest.mark.parametrize("view", ["phantoms", "grid"])
def test_a_snapshot_goes_on_bit_for_bit(defense: Any, others: dict[str, Any], role: str, view: str) -> None:
    def made() -> Learners:
        own = defense() if isinstance(defense, type) else defense
        return Learners("patrol", own, 3, view, others, max_cycles=9, learner_role=role, stagger=True)

    learners = made()
    learners.reset(2)
    play(learners, 13)
    state = pickle.loads(pickle.dumps(learners.get_state()))
    expected = play(learners, 15, first=13)
    for fresh in (made(), learners):
        fresh.set_state(state)
        assert_same(play(fresh, 15, first=13), expected)


def test_a_snapshot_of_code_that_is_gone_is_refused(tmp_path: Any) -> None:
    file = tmp_path / "mine.py"
    file.write_text("class Mine:\n    def reset(self, *_): ...\n    def update(self, *_): ...\n")
    learners = Learners("trio", f"{file}:Mine")
    learners.reset(0)
    state = learners.get_state()
    learners.set_state(state)
    del sys.modules[type(learners.env.defense).__module__]
    with pytest.raises(ValueError, match="expected the same files as when it was taken"):
        learners.set_state(state)


def test_snapshots_of_other_learners_are_refused() -> None:
    with pytest.raises(ValueError, match="the snapshot holds worlds of"):
        Learners("trio", num_worlds=2).set_state(Learners("trio", num_worlds=3).get_state())


# --- errors ---


def test_what_cannot_be_played_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown role or agent 'adversery'; did you mean 'adversary'"):
        Learners("trio", learner_role="adversery")
    with pytest.raises(ValueError, match="has no agent of role 'adversary'"):
        Learners("patrol(team.n_adversaries=0)")
    with pytest.raises(ValueError, match="expected one of adversary_0, adversary_1"):
        AdversaryEnv("patrol")
    learners = Learners("trio", num_worlds=2, view="phantoms")
    with pytest.raises(RuntimeError, match="call reset"):
        learners.step(np.zeros((2, 9)))
    learners.reset(0)
    with pytest.raises(ValueError, match=r"shape \[2, 9\]; got \[9\]"):
        learners.step(np.zeros(9))
    with pytest.raises(ValueError, match="must be finite; those of learner 1"):
        learners.step(np.array([np.zeros(9), np.full(9, np.nan)]))


# --- Gymnasium ---


@pytest.mark.parametrize("view", ["raw", "phantoms", "grid"])
def test_one_adversary_passes_gymnasiums_checker(view: str) -> None:
    env: Any = gymnasium.make(
        "trust_env.training.learning.gym:TrustEnv/Adversary-v0", scenario="trio", view=view
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)


def test_one_adversary_of_several_ends_by_truncation_and_goes_to_the_next_episode() -> None:
    others = {"adversary_1": "false_positive", "benign": "honest"}
    env = AdversaryEnv("patrol", "score", "adversary_0", "phantoms", others, max_cycles=HORIZON)
    first, info = env.reset(seed=4)
    for frame in range(HORIZON):
        seen, reward, terminated, truncated, after = env.step(np.zeros(15, dtype=np.float32))
        assert seen in env.observation_space and isinstance(reward, float) and after.keys() == info.keys()
        assert (terminated, truncated) == (False, frame == HORIZON - 1)
    assert env.arrays.frame.item() == HORIZON and env.arrays.episode.item() == 0
    assert (env.reset()[0] != first).any() and env.arrays.episode.item() == 1
    np.testing.assert_array_equal(env.reset(seed=4)[0], first)
    for copied in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        for frame in range(3):
            choices = np.full(15, 0.1 * frame, dtype=np.float32)
            np.testing.assert_array_equal(copied.step(choices)[0], copy.deepcopy(env).step(choices)[0])
            if frame == 0:
                break
    env.close()
    env.close()


def test_one_adversary_can_be_watched() -> None:
    env = AdversaryEnv("trio", render_mode="ansi")
    env.reset(seed=0)
    env.step(env.action_space.sample())
    assert "adversary_0" in env.render()
    with pytest.raises(ValueError, match="unknown render mode 'ascii'; did you mean 'ansi'"):
        AdversaryEnv("trio", render_mode="ascii")


def test_vector_env_reports_as_gymnasiums_own_does() -> None:
    """Beside a `SyncVectorEnv` of one-learner environments, which Gymnasium fills in itself."""
    ours: Any = GymVectorEnv("trio", "score", num_worlds=2, max_cycles=HORIZON)
    theirs = SyncVectorEnv(
        [lambda: RecordEpisodeStatistics(AdversaryEnv("trio", "score", max_cycles=HORIZON))] * 2,
        autoreset_mode=AutoresetMode.SAME_STEP,
    )
    assert (ours.single_observation_space, ours.action_space) == (
        theirs.single_observation_space,
        theirs.action_space,
    )
    seen, expected = ours.reset(seed=3)[0], theirs.reset(seed=3)[0]
    np.testing.assert_array_equal(seen[0], expected[0])  # the same world; the second one has another seed
    for frame in range(HORIZON + 2):
        actions = drawn(ours.learners, frame)
        got, wanted = ours.step(actions), theirs.step(actions)
        for a, b in zip(got[:4], wanted[:4], strict=True):
            assert (a.shape, a.dtype) == (b.shape, b.dtype)
            np.testing.assert_array_equal(a[0], b[0])
        infos, given = got[4], wanted[4]
        assert ("final_obs" in infos) == (frame == HORIZON - 1)
        if "final_obs" in infos:
            np.testing.assert_array_equal(infos["final_obs"][0], given["final_obs"][0])
            assert infos["final_obs"].dtype == given["final_obs"].dtype == object
            np.testing.assert_array_equal(infos["_final_obs"], given["_final_obs"])
            np.testing.assert_array_equal(infos["_final_info"], given["_final_info"])
            episode, theirs_ = infos["final_info"]["episode"], given["final_info"]["episode"]
            assert episode.keys() == theirs_.keys()
            assert episode["r"][0] == pytest.approx(theirs_["r"][0]) and episode["l"][0] == HORIZON
    with pytest.raises(ValueError, match="reset_mask"):
        ours.reset(options={"reset_mask": np.array([True, False])})


def test_gymnasiums_vector_wrappers_apply() -> None:
    env: Any = gymnasium.wrappers.vector.RecordEpisodeStatistics(
        GymVectorEnv("trio", num_worlds=3, max_cycles=4)
    )
    env.reset(seed=0)
    total = np.zeros(3)
    for frame in range(4):
        _, rewards, _, _, infos = env.step(drawn(env.unwrapped.learners, frame))
        total += rewards
    np.testing.assert_allclose(infos["episode"]["r"], total)
    np.testing.assert_array_equal(infos["episode"]["l"], 4)


# --- Stable-Baselines3 ---


@pytest.mark.extra("train")
@pytest.mark.parametrize("view", ["raw", "phantoms", "grid"])
def test_one_adversary_passes_stable_baselines_checker(view: str) -> None:
    from stable_baselines3.common.env_checker import check_env as check_for_sb3

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_for_sb3(AdversaryEnv("trio", view=view))


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
def test_vec_env_snapshot_goes_on_with_its_episode_statistics() -> None:
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
            self.final |= {
                (self.frame, i): infos[i]["terminal_observation"] for i in np.flatnonzero(dones).tolist()
            }
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
@pytest.mark.parametrize("view", ["phantoms", "grid"])
def test_ppo_learns_behind_the_usual_wrappers(view: str) -> None:
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

    from trust_env.training.learning.sb3 import LearnersVecEnv

    env = VecNormalize(VecMonitor(LearnersVecEnv("trio", num_worlds=4, view=view, max_cycles=8)))
    model = PPO("MlpPolicy", env, n_steps=16, batch_size=32, n_epochs=2, seed=0)
    before = {name: value.clone() for name, value in model.policy.state_dict().items()}
    model.learn(128)
    assert any((value != before[name]).any() for name, value in model.policy.state_dict().items())
    assert model.ep_info_buffer is not None and {e["l"] for e in model.ep_info_buffer} == {8}
    copied = pickle.loads(pickle.dumps(env))
    copied.set_venv(env.venv)
    np.testing.assert_array_equal(copied.obs_rms.mean, env.obs_rms.mean)
