"""Learners: the same frames as the environment itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from learner_runs import HORIZON, assert_same, drawn, play

from trust_env.agents import Player
from trust_env.training.learning.gym import AdversaryEnv
from trust_env.training.learning.learners import Learners
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core


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


def test_final_observations_are_those_before_the_reset() -> None:
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


def test_staggered_worlds_end_in_turn_and_later_episodes_last_the_whole_horizon() -> None:
    learners = Learners("trio", "score", 4, max_cycles=8, stagger=True)
    for _ in range(2):
        learners.reset(3)
        ends = np.array([ended for _, _, ended in play(learners, 24)])
        frames = [np.flatnonzero(ends[:, w]) + 1 for w in range(4)]
        np.testing.assert_array_equal(frames, [[2, 10, 18], [4, 12, 20], [6, 14, 22], [8, 16, 24]])


def test_benign_learners_get_the_negative_mean_of_the_adversaries() -> None:
    adversaries = Learners("patrol", "score", 2, "raw")
    benign = Learners("patrol", "score", 2, "raw", learner_role="benign")
    adversaries.reset(0)
    benign.reset(0)
    assert benign.num_learners == 6
    for _ in range(10):
        _, gains, _, _ = adversaries.step(np.zeros((4, 28)))
        _, losses, _, _ = benign.step(np.zeros((6, 28)))
        np.testing.assert_allclose(losses.reshape(2, 3), -gains.reshape(2, 2).mean(axis=1)[:, None].repeat(3, 1))


def test_a_seed_repeats_its_episodes_and_an_unseeded_reset_begins_the_next() -> None:
    learners = Learners("trio", "trust", 3)
    first, played = learners.reset(11), play(learners, 5)
    following = learners.reset()
    assert (first != following).any()
    np.testing.assert_array_equal(learners.reset(11), first)
    assert_same(play(learners, 5), played)


def test_what_cannot_be_played_raises() -> None:
    with pytest.raises(ValueError, match="unknown role or agent 'adversery'; did you mean 'adversary'"):
        Learners("trio", learner_role="adversery")
    with pytest.raises(ValueError, match="has no agent of role 'adversary'"):
        Learners("patrol(team.n_adversaries=0)")
    with pytest.raises(ValueError, match="expected one of adversary_0, adversary_1"):
        AdversaryEnv("patrol")
    learners = Learners("trio", num_worlds=2, wrapper="phantoms")
    with pytest.raises(RuntimeError, match="call reset"):
        learners.step(np.zeros((2, 9)))
    learners.reset(0)
    with pytest.raises(ValueError, match=r"shape \[2, 9\]; got \[9\]"):
        learners.step(np.zeros(9))
    with pytest.raises(ValueError, match="must be finite; those of learner 1"):
        learners.step(np.array([np.zeros(9), np.full(9, np.nan)]))
