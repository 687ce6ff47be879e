"""The PettingZoo face: rewards follow from the metrics, the trust and the weights."""

from __future__ import annotations

import numpy as np
import pytest
from parallel_envs import random_actions

import trust_env


@pytest.mark.core
@pytest.mark.nojit
def test_rewards_are_weighted_false_tracks_missing_targets_and_lost_trust():
    scenario = {"base": "case1", "reward": {"false_track": 2.0, "missing_target": 0.5, "lost_trust": 3.0}}
    env = trust_env.parallel_env(scenario, "trust")
    env.reset(seed=1)
    rng, last = np.random.default_rng(1), np.full(3, np.nan)
    for _ in range(20):
        actions = random_actions(env, rng)
        _, rewards, _, _, infos = env.step(actions)
        info, trust = infos["benign_0"] if infos else {}, env.arrays.agent_trust[0].copy()
        gain = 2.0 * info["false_tracks"] + 0.5 * info["missing_targets"]
        expected = gain - 3.0 * np.nan_to_num(last - trust)
        assert rewards["adversary_0"] == pytest.approx(expected[0])
        assert rewards["adversary_1"] == pytest.approx(expected[2])
        assert rewards["benign_0"] == pytest.approx(-(expected[0] + expected[2]) / 2)
        last = trust


def test_rewards_are_zero_without_adversaries():
    env = trust_env.parallel_env("patrol(n_adversaries=0)", "trust")
    env.reset(seed=1)
    for _ in range(20):
        _, rewards, *_ = env.step(random_actions(env, np.random.default_rng(1)))
        assert set(rewards.values()) == {0.0}
