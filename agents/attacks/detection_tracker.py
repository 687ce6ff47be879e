"""Which own detections are of the same target from frame to frame, for agents that suppress targets."""

from __future__ import annotations

import numpy as np

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
        self.alive = np.zeros(shape, dtype=bool)
        self.chosen = np.zeros(shape, dtype=bool)  # set by the caller; False for a new target
        self.missed = np.zeros(shape, dtype=np.int64)  # frames since the last detection
        self.position, self.velocity = np.zeros((*shape, 2)), np.zeros((*shape, 2))  # m, m/s
        self.p_xx, self.p_xv, self.p_vv = np.zeros(shape), np.zeros(shape), np.zeros(shape)

    def clear(self, worlds: np.ndarray) -> None:
        """Drop all targets in the worlds of a mask bool[W]."""
        self.alive[worlds] = False

    def update(self, points: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The slot int[W, n, D] of each detection's target, and bool[W, n, D]: which targets are new.

        The detections of the frame are points[W, n, D, 2] (m) where mask[W, n, D].
        """
        self._predict()
        slot = self._assign(points, mask)
        self._correct(slot, points)
        new = mask & (slot < 0)
        slot = np.where(new, self._start(new, points), slot)
        return slot, new

    def _predict(self) -> None:
        dt, q = self.dt, self.process_noise
        self.position = self.position + dt * self.velocity
        self.p_xx = self.p_xx + 2.0 * dt * self.p_xv + dt**2 * self.p_vv + q * dt**3 / 3.0
        self.p_xv = self.p_xv + dt * self.p_vv + q * dt**2 / 2.0
        self.p_vv = self.p_vv + q * dt

    def _assign(self, points: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Slot of each detection, -1 where none: pairs by d², the least first."""
        slot = np.full(mask.shape, -1, dtype=np.int64)
        d, t = used_length(mask), used_length(self.alive)  # slots empty in the whole batch cost nothing
        cost = self._distance2(points[..., :d, :], mask[..., :d], t)  # [W, n, d, t]
        while np.isfinite(cost).any():
            # Two that are each other's nearest are a greedy pair: no lesser d² can come up for either.
            nearest = cost.argmin(axis=-1)  # [W, n, d]
            nearest_back = np.take_along_axis(cost.argmin(axis=-2), nearest, axis=-1)
            least = np.take_along_axis(cost, nearest[..., None], axis=-1)[..., 0]
            pair = (nearest_back == np.arange(d)) & np.isfinite(least)
            slot[..., :d] = np.where(pair, nearest, slot[..., :d])
            taken = (np.arange(t) == nearest[..., None]) & pair[..., None]
            cost = np.where(pair[..., None] | taken.any(axis=-2, keepdims=True), np.inf, cost)
        return slot

    def _distance2(self, points: np.ndarray, mask: np.ndarray, slots: int) -> np.ndarray:
        """d²[W, n, d, t] of detections and the first t targets; infinite outside the gate."""
        dx = points[..., 0][..., None] - self.position[..., None, :slots, 0]
        dy = points[..., 1][..., None] - self.position[..., None, :slots, 1]
        distance2 = (dx * dx + dy * dy) / (self.p_xx + self.noise)[..., None, :slots]
        free = (distance2 <= GATE) & mask[..., None] & self.alive[..., None, :slots]
        return np.where(free, distance2, np.inf)

    def _correct(self, slot: np.ndarray, points: np.ndarray) -> None:
        """Kalman update of detected targets; the others count a miss, and are dropped after PATIENCE."""
        w, n, d = np.nonzero(slot >= 0)
        at = (w, n, slot[w, n, d])
        innovation = points[w, n, d] - self.position[at]
        s = self.p_xx[at] + self.noise[n, 0]
        k_x, k_v = self.p_xx[at] / s, self.p_xv[at] / s
        self.position[at] += k_x[:, None] * innovation
        self.velocity[at] += k_v[:, None] * innovation
        self.p_vv[at] -= k_v * self.p_xv[at]
        self.p_xv[at] -= k_x * self.p_xv[at]
        self.p_xx[at] -= k_x * self.p_xx[at]
        self.missed += 1
        self.missed[at] = 0
        self.alive &= self.missed <= PATIENCE

    def _start(self, new: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Slots for new targets: empty ones first, then those that have been missed longest."""
        order = np.argsort(np.where(self.alive, PATIENCE + 1 - self.missed, 0), axis=-1, kind="stable")
        slot = np.take_along_axis(order, np.maximum(np.cumsum(new, axis=-1) - 1, 0), axis=-1)
        w, n, d = np.nonzero(new)
        at = (w, n, slot[w, n, d])
        self.alive[at], self.chosen[at], self.missed[at] = True, False, 0
        self.position[at], self.velocity[at] = points[w, n, d], 0.0
        self.p_xx[at], self.p_xv[at], self.p_vv[at] = self.noise[n, 0], 0.0, self.velocity_variance
        return slot


def used_length(mask: np.ndarray) -> int:
    """Length of the last axis up to its last entry that is True anywhere; at least 1."""
    used = np.flatnonzero(mask.any(axis=tuple(range(mask.ndim - 1))))
    return int(used[-1]) + 1 if used.size else 1
