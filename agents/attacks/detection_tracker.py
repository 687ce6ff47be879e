"""Which own detections are of the same target from frame to frame, for agents that follow targets."""

from __future__ import annotations

import numpy as np

from trust_env.agents.attacks.detection_filters import FIELDS, MISSED, VX, X_PREDICTED, follow_all
from trust_env.scenario import Scenario

GATE = 13.8  # d² that 99.9 % of a target's detections stay below (chi-square, two degrees of freedom)
PATIENCE = 5  # frames without a detection after which a target is dropped


class DetectionTracker:
    """One constant-velocity filter per target that an agent sees, in T = 2D slots, for all agents of a batch.

    Both axes share one covariance, as noise is taken to be equal along them. Detections and targets are
    paired greedily, the least d² first.
    """

    def __init__(self, scenario: Scenario, agents: np.ndarray, worlds: int):
        shape = (worlds, len(agents), 2 * scenario.sensor.max_detections)  # [W, n, T]
        self.dt, self.process_noise = scenario.dt, scenario.tracker.process_noise
        self.velocity_variance = scenario.tracker.initial_velocity_variance
        noise = [scenario.agent(int(k)).sensor.covariance for k in agents]
        variance = np.array([0.5 * (r[0][0] + r[1][1]) for r in noise], dtype=np.float64)
        self.noise = variance[:, None]  # [n, 1], m²
        self.chosen = np.zeros(shape, dtype=bool)  # set by the caller; False for a new target
        self._state = np.zeros((*shape, FIELDS))
        self._state[..., MISSED] = -1.0

    @property
    def alive(self) -> np.ndarray:
        """Which slots hold a target, bool[W, n, T]."""
        return self._state[..., MISSED] >= 0.0

    @property
    def velocity(self) -> np.ndarray:
        """m/s, [W, n, T, 2]"""
        return self._state[..., VX : VX + 2]

    @property
    def predicted(self) -> np.ndarray:
        """Where targets were predicted before the detections of the frame, [W, n, T, 2], m; new ones: detected."""
        return self._state[..., X_PREDICTED : X_PREDICTED + 2]

    def clear(self, worlds: np.ndarray) -> None:
        """Drop all targets in the worlds of a mask bool[W]."""
        if worlds.any():
            self._state[worlds, ..., MISSED] = -1.0
            self.chosen[worlds] = False

    def update(self, points: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The slot int[W, n, D] of each detection's target, and bool[W, n, D]: which targets are new.

        The detections of the frame are points[W, n, D, 2] (m) where mask[W, n, D].
        """
        seen = np.where(mask[..., None], points, np.nan)
        numbers = np.array([self.dt, self.process_noise, self.velocity_variance, GATE, PATIENCE])
        slot, new = follow_all(self._state, seen, self.noise[:, 0], numbers)
        if new.any():
            w, n, d = np.nonzero(new)
            self.chosen[w, n, slot[w, n, d]] = False
        return slot, new


def used_length(mask: np.ndarray) -> int:
    """Length of the last axis up to its last entry that is True anywhere; at least 1."""
    used = np.flatnonzero(mask.any(axis=tuple(range(mask.ndim - 1))))
    return int(used[-1]) + 1 if used.size else 1
