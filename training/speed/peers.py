"""What ours is compared with. Each returns its `Run`, or raises `Missing` with the reason."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Iterator
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from trust_env.training.speed.stopwatch import Run
from trust_env.training.speed.subjects import Recorded

ORACLE = Path(__file__).resolve().parents[2] / "tests" / "oracle.py"


class Missing(Exception):
    """A peer that is not installed here; the text says what it needs."""


def mpe2_subject() -> Run:
    """Steps of mpe2's simple_spread_v3 with three agents, resets included: what users of PettingZoo know."""
    require("mpe2", "the extra `bench`")
    from mpe2 import simple_spread_v3

    env: Any = simple_spread_v3.parallel_env(N=3)
    drawn = np.random.default_rng(0).integers(0, 5, (32, 3)).tolist()
    actions = [dict(zip(env.possible_agents, frame, strict=True)) for frame in drawn]
    env.reset(seed=0)

    def run(frames: int) -> None:
        for frame in range(frames):
            if not env.agents:
                env.reset()
            env.step(actions[frame % len(actions)])

    return run


def oracle_subject(recorded: Recorded) -> Run:
    """The plain NumPy reference of the centre, frame by frame; it stands in the repository's tests."""
    oracle = _load_oracle()
    s = recorded.scenario
    agents = [s.agent(k) for k in range(s.n_agents)]
    tracker, belief = s.tracker, agents[0].belief
    params = oracle.TrackerParams(
        p_detect=belief.p_detect, beta_fp=belief.beta_fp, beta_nt=belief.beta_nt, gate=tracker.gate,
        process_noise=tracker.process_noise, initial_velocity_variance=tracker.initial_velocity_variance,
        alpha=tracker.alpha, beta=tracker.beta, confirmed_drop=tracker.confirmed_drop,
        tentative_drop=tracker.tentative_drop, max_unseen=tracker.max_unseen, capacity=tracker.max_tracks,
    )  # fmt: skip
    capacity, hold_distance = tracker.max_local_tracks, s.evidence.hold_distance
    contains = [oracle.circle(pose[:2], a.fov.radius) for a, pose in zip(agents, recorded.poses, strict=True)]
    noise = [(a.sensor.sigma or 1.0) ** 2 * np.eye(2) for a in agents]
    detections = [recorded.detections(frame) for frame in range(len(recorded.reports))]

    def begin() -> Any:
        trust = oracle.OracleTrust("paper", n_agents=s.n_agents)
        return oracle.OracleCentre(params, trust, hold_distance=hold_distance, local_capacity=capacity)

    def run(frames: int) -> None:
        centre = begin()
        for step in range(frames):
            frame = step % len(detections)
            if frame == 0:
                centre = begin()
            centre.update(detections[frame], contains, noise, s.dt)

    return run


def _load_oracle() -> Any:
    if not ORACLE.is_file():
        raise Missing("the reference in tests/oracle.py, which is in the repository only")
    spec = importlib.util.spec_from_file_location("trust_env_oracle", ORACLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # its dataclasses look it up
    spec.loader.exec_module(module)
    return module


def stonesoup_subject(recorded: Recorded) -> Run:
    """Stone Soup's Kalman filter with global nearest neighbour, the central tracker only, agent by agent."""
    require("stonesoup", "the extra `bench`")
    scans = len(recorded.scenario.agent_names)

    def run(frames: int) -> None:
        left = frames
        while left > 0:
            tracker = _stonesoup_tracker(recorded)
            count = min(left, len(recorded.reports))
            for _ in zip(range(count * scans), tracker, strict=False):
                pass
            left -= count

    return run


def _stonesoup_tracker(recorded: Recorded) -> Any:
    """A fresh tracker on the recorded scans, with the scenario's noises and gate."""
    from scipy.stats import chi2
    from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
    from stonesoup.deleter.time import UpdateTimeStepsDeleter
    from stonesoup.hypothesiser.distance import DistanceHypothesiser
    from stonesoup.initiator.simple import SimpleMeasurementInitiator
    from stonesoup.measures import Mahalanobis
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.tracker.simple import MultiTargetTracker
    from stonesoup.types.state import GaussianState
    from stonesoup.updater.kalman import KalmanUpdater

    s = recorded.scenario
    sigma, spread = s.agent(0).sensor.sigma or 1.0, s.tracker.initial_velocity_variance
    motion = CombinedLinearGaussianTransitionModel([ConstantVelocity(s.tracker.process_noise)] * 2)
    measurement = LinearGaussian(ndim_state=4, mapping=(0, 2), noise_covar=sigma**2 * np.eye(2))
    updater = KalmanUpdater(measurement)
    gate = float(np.sqrt(chi2.ppf(s.tracker.gate, 2)))
    hypothesiser = DistanceHypothesiser(KalmanPredictor(motion), updater, Mahalanobis(), missed_distance=gate)
    prior = GaussianState([[0.0]] * 4, np.diag([0.0, spread, 0.0, spread]))
    return MultiTargetTracker(
        initiator=SimpleMeasurementInitiator(prior, measurement),
        deleter=UpdateTimeStepsDeleter(3 * s.n_agents),
        detector=_Scans(recorded, measurement),
        data_associator=GNNWith2DAssignment(hypothesiser),
        updater=updater,
    )


class _Scans:
    """The recorded scans as Stone Soup's detections, one agent after another."""

    def __init__(self, recorded: Recorded, measurement: Any):
        self._recorded, self._measurement = recorded, measurement

    def __iter__(self) -> Iterator[tuple[datetime, set[Any]]]:
        from stonesoup.types.detection import Detection

        start, dt = datetime(2024, 1, 1), self._recorded.scenario.dt
        for frame in range(len(self._recorded.reports)):
            now = start + timedelta(seconds=frame * dt)
            for points in self._recorded.detections(frame):
                found = (
                    Detection(p[:, None], timestamp=now, measurement_model=self._measurement) for p in points
                )
                yield now, set(found)


def require(module: str, extra: str) -> None:
    """Raises `Missing` where a module cannot be imported."""
    try:
        importlib.import_module(module)
    except ImportError:
        raise Missing(f"{module} ({extra})") from None
