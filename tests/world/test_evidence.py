"""Evidence that goes beyond who saw what: hits, probabilities of lying inside an FOV, areas, beliefs, draws."""

from __future__ import annotations

import math

import numpy as np
import pytest

import trust_env

_FOVS = {
    "circle": {"type": "circle", "radius": 300.0},
    "sector": {"type": "sector", "radius": 300.0, "width": 1.2, "heading": 0.7},
    "wide": {"type": "sector", "radius": 300.0, "width": 4.0, "heading": -2.0},
    "polygon": {"type": "polygon", "vertices": [[-100.0, -200.0], [250.0, -50.0], [200.0, 200.0], [-150.0, 150.0]]},
}


class Keep:
    """A defense without opinions that keeps copies of the evidence."""

    def __init__(self) -> None:
        self.frames: list[dict] = []

    def reset(self, shape: trust_env.Shape, worlds: np.ndarray) -> None:
        pass

    def update(self, evidence: trust_env.Evidence) -> trust_env.Verdict:
        self.evidence = evidence
        arrays = {name: np.copy(value) for name, value in vars(evidence).items() if isinstance(value, np.ndarray)}
        self.frames.append(arrays)
        return trust_env.Verdict()


def _played(scenario, frames: int, worlds: int = 3) -> Keep:
    defense = Keep()
    env = trust_env.vector_env(scenario, defense, num_worlds=worlds)
    env.reset(seed=5)
    rng = np.random.default_rng(1)
    for _ in range(frames):
        env.step(rng.uniform(-1.0, 1.0, env.arrays.action.shape))
    return defense


def _scenario(fov: str) -> dict:
    return {"base": "patrol", "fov": _FOVS[fov]}


@pytest.mark.parametrize("fov", _FOVS)
def test_inside_is_the_share_of_the_track_that_lies_in_the_fov(fov):
    rng = np.random.default_rng(2)
    near = {"corner": 0, "edge": 0}
    defense = _played(_scenario(fov), 12)
    for e in defense.frames[2::3]:
        for w, k, j in np.argwhere((e["status"] > 0)[:, None] & (abs(e["inside"] - 0.5) < 0.4999)):
            points = rng.multivariate_normal(e["track_mean"][w, j, :2], e["track_cov"][w, j, :2, :2], 4000)
            pose = e["pose"][w, k]
            frame = np.array([*pose[:2], math.cos(pose[2]), math.sin(pose[2])])
            fovs = defense.evidence.fovs
            drawn = fovs.contains(np.broadcast_to(frame, (len(e["pose"][w]), 4)), points[None])[k].mean()
            near["edge" if abs(drawn - e["inside"][w, k, j]) < 0.04 else "corner"] += 1
    assert near["edge"] > 15 and near["corner"] <= 0.1 * near["edge"]


@pytest.mark.parametrize("fov", _FOVS)
def test_inside_agrees_with_expected_about_the_half(fov):
    for e in _played(_scenario(fov), 8).frames:
        known = np.broadcast_to((e["status"] > 0)[:, None], e["expected"].shape)
        assert np.array_equal(e["inside"][known] > 0.5, e["expected"][known])
        assert (e["inside"][known] >= 0.0).all() and (e["inside"][known] <= 1.0).all()


@pytest.mark.parametrize("fov", _FOVS)
def test_covered_cells_add_up_to_the_area_of_the_fov(fov):
    e = _played(_scenario(fov), 1).frames[0]
    area = trust_env.load_scenario(_scenario(fov)).agent(0).fov.area
    assert e["covered"].sum(axis=-1) * e["cell_area"][:, None] == pytest.approx(area, rel=0.08)


def test_coverage_follows_the_agents_of_each_episode_and_of_each_update():
    defense = Keep()
    env = trust_env.vector_env("patrol", defense, num_worlds=2, max_cycles=3)
    env.reset(seed=0)
    for _ in range(4):
        env.step(np.zeros(env.arrays.action.shape))
    first, again, other = (defense.frames[i]["covered"] for i in (0, 2, 3))
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    centre = trust_env.FusionCentre("case1", defense)
    for x in (0.0, 0.0, 5.0):
        centre.update([[], [], []], poses=[[x, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    before, same, moved = (frame["covered"][0] for frame in defense.frames[-3:])
    assert np.array_equal(before, same) and not np.array_equal(before[1], moved[1])


def test_a_hit_is_an_assigned_detection():
    hits = 0
    for e in _played("patrol", 15).frames:
        for w, k in np.ndindex(e["hit"].shape[:2]):
            assigned = e["assignment"][w, k, : e["detection_count"][w, k]]
            assert set(np.flatnonzero(e["hit"][w, k])) == set(assigned[assigned >= 0].tolist())
        assert np.array_equal(
            e["hit"] & (e["status"] > 0)[:, None], ~np.isnan(e["distance2"]) & (e["status"] > 0)[:, None]
        )
        hits += int(e["hit"].sum())
    assert hits > 100


def test_predictions_are_those_from_which_the_first_hit_was_judged():
    seen = 0
    for e in _played("patrol", 10).frames:
        for w, j in np.argwhere((e["status"] > 0) & (e["age"] > 1) & e["hit"].any(axis=1)):
            k = int(np.argmax(e["hit"][w, :, j]))
            d = int(np.flatnonzero(e["assignment"][w, k, : e["detection_count"][w, k]] == j)[0])
            expected = e["detections"][w, k, d] - e["predicted_mean"][w, j, :2]
            assert e["innovation"][w, k, j] == pytest.approx(expected, abs=1e-9)
            cov = e["predicted_cov"][w, j, :2, :2] + 25.0 * np.eye(2)
            assert e["innovation_cov"][w, k, j] == pytest.approx(cov, rel=1e-9)
            seen += 1
    assert seen > 30


def test_a_new_track_has_no_prediction():
    for e in _played("patrol", 4).frames:
        new = (e["status"] > 0) & (e["age"] == 1)
        assert (
            np.isnan(e["predicted_mean"][new]).all()
            and not np.isnan(e["predicted_mean"][(e["age"] > 1) & (e["status"] > 0)]).any()
        )


def test_the_tracker_s_beliefs_are_given_and_not_the_truth():
    agents = [{"role": "benign"}, {"role": "adversary", "belief": {"p_detect": 0.7, "compromised": 0.25}}]
    scenario = {"base": "patrol", "agents": agents, "sensor": {"p_detect": 0.5}}
    belief = _played(scenario, 1).evidence.belief
    assert belief.p_detect == pytest.approx([0.9, 0.7]) and belief.beta_fp == pytest.approx([1e-6, 1e-6])
    assert belief.prior_compromised == pytest.approx([math.nan, 0.25], nan_ok=True)
    assert belief.noise_cov[1] == pytest.approx(25.0 * np.eye(2)) and belief.velocity_variance == 36.0


def test_draws_depend_on_the_world_and_the_frame_and_not_on_the_batch():
    draws = {}
    for worlds in (2, 5):
        defense = Keep()
        env = trust_env.vector_env("trio", defense, num_worlds=worlds)
        env.reset(seed=3)
        rows = []
        for _ in range(2):
            env.step(np.zeros(env.arrays.action.shape))
            rows.append(defense.evidence.uniforms(4))
        draws[worlds] = np.array(rows)
    assert np.array_equal(draws[2], draws[5][:, :2])
    assert len(np.unique(draws[5])) == draws[5].size


def test_points_are_held_by_the_fovs_that_expect_tracks_there():
    defense = Keep()
    env = trust_env.vector_env("patrol", defense, num_worlds=3)
    env.reset(seed=1)
    for _ in range(6):
        env.step(np.zeros(env.arrays.action.shape))
    e = defense.evidence
    known = np.broadcast_to((e.status > 0)[:, None], e.expected.shape)
    assert np.array_equal(e.contains(e.track_mean[..., :2])[known], e.expected[known])
