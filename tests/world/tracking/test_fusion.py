"""Fusion rules against every subset tried in plain Python, and against liars."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import trust_env

RULES = ("trimmed_mean", "residual_clique", "secure_estimate")
NOISE = np.array([[9.0, 4.0], [4.0, 25.0]])


class Keep:
    """A defense without opinions that keeps the last frame's evidence."""

    def reset(self, shape: trust_env.Shape, worlds: np.ndarray) -> None:
        pass

    def update(self, evidence: trust_env.Evidence) -> trust_env.Verdict:
        self.evidence = evidence
        return trust_env.Verdict()


def _scenario(rule: str, agents: int, tolerance: int, **tracker) -> dict:
    team = {"n_adversaries": 0, "n_benign": agents, "placement": "together"}
    fusion = {"fusion": rule, "fusion_tolerance": tolerance, **tracker}
    sensor = {"sigma": None, "noise_cov": NOISE.tolist()}
    return {"base": "patrol", "team": team, "tracker": fusion, "sensor": sensor}


def _agree(points: np.ndarray) -> bool:
    """Whether hits [m, 2] agree pairwise."""
    differences = [a - b for a, b in itertools.combinations(points, 2)]
    return all(d @ np.linalg.solve(2.0 * NOISE, d) < 9.21 for d in differences)


def _spread(points: np.ndarray) -> float:
    return float(((points - points.mean(axis=0)) ** 2).sum())


def _fused(rule: str, points: np.ndarray, tolerance: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Position and covariance of m hits [m, 2], as the rule's definition says."""
    m = len(points)
    if m <= 2 * tolerance:
        return None
    if rule == "trimmed_mean":
        middle = np.sort(points, axis=0)[tolerance : m - tolerance]
        return middle.mean(axis=0), NOISE / len(middle)
    sizes = [m - tolerance] if rule == "secure_estimate" else range(m, 0, -1)
    for size in sizes:
        subsets = [points[list(s)] for s in itertools.combinations(range(m), size)]
        allowed = [s for s in subsets if rule == "secure_estimate" or _agree(s)]
        if allowed:
            return min(allowed, key=_spread).mean(axis=0), NOISE / size
    raise AssertionError


def _updated(mean: np.ndarray, cov: np.ndarray, point: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The textbook's Kalman update."""
    h = np.eye(2, 4)
    gain = cov @ h.T @ np.linalg.inv(h @ cov @ h.T + noise)
    return mean + gain @ (point - mean[:2]), (np.eye(4) - gain @ h) @ cov


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize(("agents", "tolerance"), [(3, 1), (5, 2), (7, 2), (4, 0), (9, 3)])
def test_a_track_is_updated_as_the_rule_is_defined(rule: str, agents: int, tolerance: int):
    defense, rng, updates = Keep(), np.random.default_rng(agents), 0
    centre = trust_env.FusionCentre(_scenario(rule, agents, tolerance, gate=0.999999999), defense)
    for _ in range(30):
        points = rng.multivariate_normal([3.0, 4.0], 6.0 * NOISE, agents)
        reporting = rng.random(agents) < 0.9
        centre.update([points[k : k + 1] if reporting[k] else [] for k in range(agents)])
        e = defense.evidence
        for j in np.flatnonzero((e.status[0] > 0) & (e.age[0] > 1)):
            listed = np.arange(e.detections.shape[2]) < e.detection_count[0][:, None]
            hits = e.detections[0][listed & (e.assignment[0] == j)]
            before = e.predicted_mean[0, j], e.predicted_cov[0, j]
            fused = _fused(rule, hits, tolerance) if len(hits) else None
            mean, cov = before if fused is None else _updated(*before, *fused)
            assert e.track_mean[0, j] == pytest.approx(mean, rel=1e-9, abs=1e-9)
            assert e.track_cov[0, j] == pytest.approx(cov, rel=1e-9, abs=1e-9)
            updates += fused is not None
    assert updates > 10


@pytest.mark.parametrize("rule", RULES)
def test_tracks_with_too_few_hits_keep_their_prediction_and_are_counted(rule: str):
    defense = Keep()
    centre = trust_env.FusionCentre(_scenario(rule, 3, 1), defense)
    centre.update([[[0.0, 0.0]], [], []])
    centre.update([[[1.0, 1.0]], [[1.0, 2.0]], []])
    e = defense.evidence
    assert e.hit[0, :, 0].tolist() == [True, True, False]
    assert np.array_equal(e.track_mean[0, 0], e.predicted_mean[0, 0])
    assert e.score[0, 0] > e.agent_score[0, 0, 0]  # on existence all hits count
    assert centre._worlds.arrays.overflow_unfused_tracks[0] == 1


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("agents", [5, 13])
def test_a_liar_does_not_move_the_track(rule: str, agents: int):
    """The last agent reports 14 m beside the target; the others are exact."""

    def error(rule: str) -> float:
        centre = trust_env.FusionCentre(_scenario(rule, agents, 1, gate=0.9999999), "score")
        for _ in range(20):
            found = centre.update([*[[[0.0, 0.0]]] * (agents - 1), [[14.0, 0.0]]])
        return float(np.hypot(*found.tracks[found.status == 2][0, :2]))

    assert error(rule) < 0.05 < 0.5 * error("sequential")


def test_agents_whose_noise_differs_are_fused_by_information():
    defense = Keep()
    agents = [{"role": "benign", "position": [0.0, 0.0], "sensor": {"sigma": s}} for s in (1.0, 2.0, 5.0)]
    scenario = {"base": "patrol", "agents": agents, "tracker": {"fusion": "residual_clique"}}
    centre = trust_env.FusionCentre(scenario, defense)
    points = np.array([[0.0, 0.0], [1.0, 2.0], [-2.0, 1.0]])
    for _ in range(2):
        centre.update([points[k : k + 1] for k in range(3)])
    e, information = defense.evidence, np.array([1.0, 0.25, 0.04])
    fused = (information[:, None] * points).sum(axis=0) / information.sum()
    mean, _ = _updated(e.predicted_mean[0, 0], e.predicted_cov[0, 0], fused, np.eye(2) / information.sum())
    assert e.hit[0, :, 0].all() and e.track_mean[0, 0] == pytest.approx(mean, rel=1e-9)


def test_rules_play_whole_episodes_and_differ():
    found = {}
    for rule in ("sequential", *RULES):
        env = trust_env.vector_env({"base": "patrol", "tracker": {"fusion": rule}}, "trust", num_worlds=4)
        env.reset(seed=2)
        shown = np.zeros(4)
        for _ in range(60):
            info = env.step(np.zeros(env.arrays.action.shape))[4]
            assert np.isfinite(info["gospa"]).all()
            shown += info["published_tracks"]
        assert np.linalg.eigvalsh(env.arrays.track_cov[env.arrays.track_status > 0]).min() > 0.0
        found[rule] = float(shown.mean())
    assert len(set(found.values())) == 4
