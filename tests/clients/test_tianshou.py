"""Tianshou's PettingZoo environment: the agents in turn."""

from __future__ import annotations

import numpy as np
import pytest
from clients.checks import check_trained

import trust_env

pytestmark = pytest.mark.extra("clients")


@pytest.mark.parametrize("scenario", ["trio", "patrol"])
def test_the_example_trains(scenario):
    from trust_env.training.examples import tianshou_sac

    check_trained(tianshou_sac.train(updates=2, scenario=scenario), 2, {"adversary", "benign"})


def test_turns_add_up_to_the_frames_of_the_environment():
    from tianshou.env import PettingZooEnv

    env = trust_env.parallel_env("trio", "trust", max_cycles=12)
    turns = PettingZooEnv(trust_env.env("trio", "trust", max_cycles=12))
    expected, _ = env.reset(seed=5)
    seen, _ = turns.reset(seed=5)
    rng = np.random.default_rng(0)
    for frame in range(12):
        names = env.agents[:]
        actions = {name: rng.uniform(-1.0, 1.0, 18).astype(np.float32) for name in names}
        for name in names:
            assert seen["agent_id"] == name
            np.testing.assert_array_equal(seen["obs"], expected[name])
            seen, rewards, terminated, truncated, _ = turns.step(actions[name])
            assert not terminated
            assert truncated == (frame == 11 and name == names[-1])
            if name != names[-1]:
                assert rewards == [0, 0, 0]
        expected, gained, *_ = env.step(actions)
        assert rewards == list(gained.values())


def test_returns_reach_the_rewards_of_the_own_frame():
    """What the example says of them: the reward of a frame, discounted by the turns to the last agent's."""
    import torch
    from tianshou.algorithm import MultiAgentOffPolicyAlgorithm
    from tianshou.data import Batch, ReplayBuffer
    from tianshou.env import PettingZooEnv

    from trust_env.training.examples.tianshou_sac import Learner

    env = PettingZooEnv(trust_env.env("trio"))
    algorithm = MultiAgentOffPolicyAlgorithm(algorithms=[learner := Learner(env)] * 3, env=env)
    learner._target_q = lambda buffer, indices: torch.zeros(len(indices), 1)
    buffer, turn = (
        ReplayBuffer(20),
        {"act": np.zeros(18), "terminated": False, "truncated": False, "info": {}},
    )
    for i in range(9):  # three frames, that are worth 1, 2, 3 to all
        rew = np.full(3, 1.0 + i // 3) if i % 3 == 2 else np.zeros(3)
        seen, ahead = ({"agent_id": env.agents[j % 3], "obs": np.zeros(78)} for j in (i, i + 1))
        buffer.add(Batch(obs=seen, obs_next=ahead, rew=rew, **turn))
    processed = algorithm._preprocess_batch(buffer[:], buffer, np.arange(9))
    for k, name in enumerate(env.agents):
        expected = np.array([1.0, 2.0, 3.0]) * learner.gamma ** (2 - k)
        np.testing.assert_allclose(processed[name].returns.ravel(), expected, rtol=1e-6)
