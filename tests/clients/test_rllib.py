"""RLlib's new API stack, on its PettingZoo wrapper."""

from __future__ import annotations

import numpy as np
import pytest
from clients.checks import check_trained

import trust_env

pytestmark = pytest.mark.extra("clients")


@pytest.fixture(autouse=True, scope="module")
def quiet_ray():
    """Ray neither reports home nor asks for a token on this machine."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        patch.setenv("RAY_AUTH_MODE", "disabled")
        yield


def test_the_example_trains_the_adversaries_only():
    from trust_env.training.examples import rllib

    check_trained(rllib.train(updates=2, scenario="patrol"), 2, {"adversary"})


def test_both_sides_learn_at_once():
    from trust_env.training.examples import rllib_both_sides

    check_trained(rllib_both_sides.train(updates=2), 2, {"adversary", "benign"})


def test_the_module_of_the_benign_agents_is_honest():
    import torch
    from ray.rllib.core.columns import Columns

    from trust_env.training.examples.rllib import Honest

    env = trust_env.parallel_env("trio")
    module = Honest(observation_space=env.observation_space("benign_0"), action_space=env.action_space("benign_0"))
    chosen = module.forward_exploration({Columns.OBS: torch.ones(5, 78)})[Columns.ACTIONS]
    assert chosen.shape == (5, 18)
    assert not chosen.any()


def test_the_wrapper_plays_what_the_environment_plays():
    from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv

    env = trust_env.parallel_env("trio", "trust", max_cycles=12)
    wrapped = ParallelPettingZooEnv(trust_env.parallel_env("trio", "trust", max_cycles=12))
    expected, _ = env.reset(seed=5)
    seen, _ = wrapped.reset(seed=5)
    rng = np.random.default_rng(0)
    for frame in range(12):
        for name, observation in expected.items():
            np.testing.assert_array_equal(seen[name], observation)
            assert observation in wrapped.observation_space[name]
        actions = {name: rng.uniform(-1.0, 1.0, 18).astype(np.float32) for name in env.agents}
        expected, rewards, *_ = env.step(actions)
        seen, gained, terminated, truncated, _ = wrapped.step(actions)
        assert gained == rewards
        assert (terminated["__all__"], truncated["__all__"]) == (False, frame == 11)
