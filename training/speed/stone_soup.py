"""Stone Soup's tracker as a peer of the fusion centre."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from trust_env.training.speed.missing import require
from trust_env.training.speed.stopwatch import Run
from trust_env.training.speed.subjects import RecordedEpisode


def stonesoup_subject(recorded: RecordedEpisode) -> Run:
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


def _stonesoup_tracker(recorded: RecordedEpisode) -> Any:
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

    def __init__(self, recorded: RecordedEpisode, measurement: Any):
        self._recorded, self._measurement = recorded, measurement

    def __iter__(self) -> Iterator[tuple[datetime, set[Any]]]:
        from stonesoup.types.detection import Detection

        start, dt = datetime(2024, 1, 1), self._recorded.scenario.dt
        for frame in range(len(self._recorded.reports)):
            now = start + timedelta(seconds=frame * dt)
            for points in self._recorded.detections(frame):
                found = (Detection(p[:, None], timestamp=now, measurement_model=self._measurement) for p in points)
                yield now, set(found)
