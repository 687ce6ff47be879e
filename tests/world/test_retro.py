"""The actuation `retro`: once an agent is accused, the last frames are tracked again without its reports."""

from __future__ import annotations

import numpy as np
import pytest

import trust_env

ACCUSED = 1  # the agent whose trust is low


class Accuse:
    """Trust 0 in one agent from a frame on, until another frame; no opinion of tracks."""

    def __init__(self, first: int, last: int = 10**9):
        self.first, self.last = first, last

    def reset(self, shape: trust_env.Shape, worlds: np.ndarray) -> None:
        self.shape = shape

    def update(self, evidence: trust_env.Evidence) -> trust_env.Verdict:
        trust = np.full((self.shape.W, self.shape.K), 0.9)
        trust[(evidence.frame >= self.first) & (evidence.frame < self.last), ACCUSED] = 0.0
        return trust_env.Verdict(agent_trust=trust)


def _centre(first: int, **overrides) -> trust_env.FusionCentre:
    team = {"n_adversaries": 0, "n_benign": 3, "placement": "together"}
    fields = {"base": "patrol", "team": team, "actuation": "retro", "metrics": {"accuse_frames": 4}}
    return trust_env.FusionCentre({**fields, **overrides}, Accuse(first))


def _reports(rng: np.random.Generator, present: set[int] | range) -> list:
    """Two targets that all see, and a place that only the accused agent reports."""
    places = np.array([[0.0, 0.0], [60.0, 0.0]])
    reports = [(places + rng.normal(0.0, 5.0, places.shape)).tolist() for _ in range(3)]
    reports[ACCUSED].append([-100.0, 50.0])
    return [report if k in present else [] for k, report in enumerate(reports)]


@pytest.mark.core
def test_the_second_run_is_what_the_centre_would_have_found_without_the_agent():
    window, first = 8, 12
    centre, rng = _centre(first, retro_window=window), np.random.default_rng(0)
    told = [_reports(rng, range(3)) for _ in range(30)]
    found = [centre.update(report) for report in told]
    again = first + 3  # the frame in which the agent's trust was low for the fourth time
    other = _centre(10**9)
    poses = [[0.0, 0.0, 0.0], [1e6, 0.0, 0.0], [0.0, 0.0, 0.0]]  # elsewhere the agent misses nothing either
    for frame in range(again - window + 1, len(told)):
        silent = [[] if k == ACCUSED else report for k, report in enumerate(told[frame])]
        expected = other.update(silent, poses=poses)
        if frame >= again:
            assert found[frame].tracks == pytest.approx(expected.tracks, rel=1e-12, abs=1e-12)
            assert found[frame].scores == pytest.approx(expected.scores, rel=1e-12)
            assert np.array_equal(found[frame].status, expected.status)
            assert np.array_equal(found[frame].picture, expected.picture)
    assert len(found[again - 1].picture) == 3 and len(found[again].picture) == 2


def test_tracks_of_the_second_run_have_new_ids():
    centre, rng = _centre(10), np.random.default_rng(1)
    found = [centre.update(_reports(rng, range(3))) for _ in range(14)]
    assert set(found[12].track_id) & set(found[11].track_id)
    assert not set(found[13].track_id) & set(found[12].track_id)


def test_an_agent_counts_again_once_its_trust_has_recovered():
    scenario = {"base": "patrol", "actuation": "retro"}
    env = trust_env.vector_env(scenario, Accuse(5, 20), num_worlds=2)
    env.reset(seed=0)
    weights = []
    for _ in range(30):
        env.step(np.zeros(env.arrays.action.shape))
        weights.append(env.arrays.agent_weight[:, ACCUSED].copy())
    assert (np.array(weights)[[13, 20, 29]] == 1.0).all() and (np.array(weights)[14:20] == 0.0).all()


def test_nothing_happens_where_nobody_is_accused():
    found = []
    for actuation in ("filter", "retro"):
        env = trust_env.vector_env({"base": "patrol", "actuation": actuation}, Accuse(10**9), num_worlds=3)
        env.reset(seed=1)
        found.append(np.stack([env.step(np.zeros(env.arrays.action.shape))[0] for _ in range(25)]))
    assert np.array_equal(*found)


def test_a_run_goes_on_from_a_snapshot_to_the_same_bits():
    env = trust_env.parallel_env({"base": "patrol", "actuation": "retro"}, Accuse(25))
    env.reset(seed=3)
    rng = np.random.default_rng(0)
    actions = [{a: rng.uniform(-1.0, 1.0, env.action_space(a).shape) for a in env.agents} for _ in range(80)]
    for step in actions[:30]:
        env.step(step)
    state, ends = env.get_state(), []
    for _ in range(2):
        env.set_state(state)
        for step in actions[30:]:
            observations = env.step(step)[0]
        ends.append(np.concatenate([*observations.values(), env.arrays.track_mean.ravel()]))
    assert np.array_equal(*ends)
    assert env.arrays.retro_frames_below.max() > 40


def test_only_this_actuation_keeps_reports():
    assert trust_env.vector_env("patrol", "score").arrays.retro_kept_count.size == 0
    env = trust_env.vector_env({"base": "patrol", "actuation": "retro", "retro_window": 7}, "score")
    assert env.arrays.retro_kept_count.shape == (1, 7, 5)
