"""Against Stone Soup: the same filter to rounding, and as good a tracker on the same detections."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from scipy.stats import chi2

import trust_env

pytestmark = pytest.mark.extra("bench")

START = datetime.datetime(2024, 1, 1)
CUTOFF, ORDER = 50.0, 2.0
CLUTTERED: dict[str, Any] = {
    "base": "patrol",
    "fov": {"radius": 750.0},  # about the whole area: Stone Soup's trackers know nothing of fields of view
    "sensor": {"clutter_density": 3e-6, "max_detections": 40},
    "tracker": {"beta_fp": 3e-6},
}
Frames = list[tuple[list[np.ndarray], np.ndarray]]  # per frame, the scans of all agents [n, 2] and the truth [n, 2]


def gospa(estimates: np.ndarray, truth: np.ndarray) -> float:
    """α = 2 (Rahmathullah, García-Fernández & Svensson 2017)."""
    n, m = len(estimates), len(truth)
    distance = np.hypot(*(estimates[:, None] - truth[None]).transpose(2, 0, 1)) if n and m else np.zeros((n, m))
    cost = np.minimum(distance, CUTOFF) ** ORDER
    pairs = linear_sum_assignment(cost)
    return float((cost[pairs].sum() + CUTOFF**ORDER / 2 * abs(n - m)) ** (1 / ORDER))


def run_ours(scenario: Mapping[str, Any], seed: int, frames: int) -> tuple[Frames, float, Any]:
    """An honest episode: what was detected, our mean GOSPA, and the scenario."""
    env = trust_env.vector_env(dict(scenario), "score", max_cycles=frames + 1)
    env.reset(seed=seed)
    a, recorded, errors = env.arrays, [], []
    for _ in range(frames):
        scans = [a.raw_detections[0, k, :n].copy() for k, n in enumerate(a.raw_count[0])]
        env.step(np.zeros(a.action.shape))
        truth = a.scored_state[0][a.scored_visible[0]][:, :2].copy()
        recorded.append((scans, truth))
        errors.append(gospa(a.track_mean[0][a.published[0]][:, :2], truth))
    return recorded, float(np.mean(errors)), env.scenario


def models(scenario: Any) -> tuple[Any, Any, Any, Any]:
    """Predictor, updater, measurement model and prior of the same assumptions as the scenario's tracker."""
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.state import GaussianState
    from stonesoup.updater.kalman import KalmanUpdater

    axis = ConstantVelocity(scenario.tracker.process_noise)
    measurement = LinearGaussian(4, (0, 2), np.array(scenario.agent(0).sensor.covariance))
    rate = scenario.tracker.initial_velocity_variance
    prior = GaussianState(np.zeros((4, 1)), np.diag([0.0, rate, 0.0, rate]))
    predictor = KalmanPredictor(CombinedLinearGaussianTransitionModel([axis, axis]))
    return predictor, KalmanUpdater(measurement), measurement, prior


def detection(point: np.ndarray, seconds: float, model: Any) -> Any:
    from stonesoup.types.detection import Detection

    when = START + datetime.timedelta(seconds=seconds)
    return Detection(point.reshape(2, 1), timestamp=when, measurement_model=model)


def run_stonesoup(frames: Frames, scenario: Any, *, hits: int, misses: int, tentative_misses: int) -> float:
    """Mean GOSPA of its nearest neighbour tracker: `hits` confirm a track, `misses` in a row delete it."""
    from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
    from stonesoup.deleter.time import UpdateTimeStepsDeleter
    from stonesoup.hypothesiser.distance import DistanceHypothesiser
    from stonesoup.initiator.simple import MultiMeasurementInitiator
    from stonesoup.measures import Mahalanobis
    from stonesoup.tracker.simple import MultiTargetTracker

    predictor, updater, measurement, prior = models(scenario)
    gate = float(np.sqrt(chi2.ppf(scenario.tracker.gate, 2)))
    associator = GNNWith2DAssignment(DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=gate))
    initiator = MultiMeasurementInitiator(
        prior_state=prior,
        measurement_model=measurement,
        deleter=UpdateTimeStepsDeleter(tentative_misses),
        data_associator=associator,
        updater=updater,
        min_points=hits,
    )
    scans = [
        (START + datetime.timedelta(seconds=f), {detection(point, f, measurement) for point in scan})
        for f, (agents, _) in enumerate(frames)
        for scan in agents
    ]
    tracker = MultiTargetTracker(initiator, UpdateTimeStepsDeleter(misses), scans, associator, updater)
    errors, n_agents = [], len(frames[0][0])
    for scan, (_, tracks) in enumerate(tracker):
        if scan % n_agents == n_agents - 1:
            estimates = np.array([[float(t.state_vector[0]), float(t.state_vector[2])] for t in tracks])
            errors.append(gospa(estimates.reshape(-1, 2), frames[scan // n_agents][1]))
    assert len(errors) == len(frames)
    return float(np.mean(errors))


def test_the_filter_is_the_same():
    """One target without clutter: every state and covariance, through hits and misses."""
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import GaussianState

    scenario = {
        "base": "case1",
        "dt": 0.7,
        "agents": [{"role": "benign", "position": [0, 0]}],
        "injections": [],
        "sensor": {"p_detect": 0.8, "sigma": None, "noise_cov": [[4.0, 1.0], [1.0, 2.0]]},
        "targets": {"positions": [[10.0, 5.0]], "velocities": [[1.0, -2.0]], "process_noise": 0.3},
        "tracker": {
            "process_noise": 0.3,
            "initial_velocity_variance": 9.0,
            "gate": 0.99999,
            "confirmed_drop": 99.0,
        },
        "fov": {"radius": 1e4},
    }
    env = trust_env.vector_env(scenario, "score", max_cycles=80)
    env.reset(seed=2)
    predictor, updater, measurement, _ = models(env.scenario)
    order, a, state = [0, 2, 1, 3], env.arrays, None
    for frame in range(60):
        seconds, scan = 0.7 * frame, a.raw_detections[0, 0, : a.raw_count[0, 0]].copy()
        env.step(np.zeros(a.action.shape))
        assert len(scan) <= 1 and (a.track_status[0] > 0).sum() <= 1
        when = START + datetime.timedelta(seconds=seconds)
        if state is None:
            if len(scan):
                cov = np.zeros((4, 4))
                cov[np.ix_([0, 2], [0, 2])], cov[[1, 3], [1, 3]] = measurement.noise_covar, 9.0
                mean = np.array([scan[0, 0], 0.0, scan[0, 1], 0.0]).reshape(4, 1)
                state = GaussianState(mean, cov, timestamp=when)
            continue
        state = predictor.predict(state, timestamp=when)
        if len(scan):
            state = updater.update(SingleHypothesis(state, detection(scan[0], seconds, measurement)))
        mean, cov = np.array(state.state_vector, float).ravel(), np.array(state.covar, float)
        assert a.track_mean[0, 0] == pytest.approx(mean[order], abs=1e-9)
        assert a.track_cov[0, 0] == pytest.approx(cov[np.ix_(order, order)], abs=1e-9)
    assert a.track_hits[0, 0] > 40


def test_one_sensor_under_the_same_rules():
    """Three hits confirm; two misses end a tentative track, three or five a confirmed one (2.3 nats each)."""
    lone = CLUTTERED | {"agents": [{"role": "benign", "position": [0.0, 0.0]}]}
    rules = {"confirmation": "m_of_n", "confirm_m": 3, "confirm_n": 4, "tentative_drop": 4.5}
    ours, theirs = [], []
    for seed in range(3):
        for misses, drop in ((3, 4.7), (5, 9.3)):
            scenario = lone | {"tracker": CLUTTERED["tracker"] | rules | {"confirmed_drop": drop}}
            frames, error, loaded = run_ours(scenario, seed, frames=100)
            ours.append(error)
            theirs.append(run_stonesoup(frames, loaded, hits=3, misses=misses, tentative_misses=2))
    assert np.mean(ours) <= 1.02 * np.mean(theirs)


def test_three_sensors_with_the_default_rules():
    """Our score test against the best of several counts of hits and misses."""
    team = {"n_adversaries": 0, "n_benign": 3, "placement": "together"}
    counts = [(4, 3), (5, 3)]
    ours, theirs = [], []
    for seed in range(2):
        frames, error, loaded = run_ours(CLUTTERED | {"team": team}, seed, frames=40)
        ours.append(error)
        theirs.append([run_stonesoup(frames, loaded, hits=h, misses=m, tentative_misses=2) for h, m in counts])
    assert np.mean(ours) <= 1.02 * np.mean(theirs, axis=0).min()
