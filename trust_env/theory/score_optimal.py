"""In which frame a score-optimal false positive is confirmed: the score recursion with the filter's own S."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from trust_env.theory.arguments import Matrix, as_covariance, require, require_non_negative, require_positive
from trust_env.theory.score import max_hit_gain, score_to_confirm

_STEADY = 1e-13  # a frame that changes the covariance by less, relative to the predicted one, is steady


def score_optimal_frames(
    order: Iterable[str],
    *,
    p_detect: float = 0.9,
    beta_fp: float = 1e-6,
    beta_nt: float = 1e-9,
    alpha: float = 1e-4,
    beta: float = 1e-2,
    noise_cov: ArrayLike | None = None,
    initial_velocity_variance: float = 1e-4,
    process_noise: float = 1e-6,
    dt: float = 0.1,
    tentative_drop: float = 4.5,
) -> float:
    """Frame, from 1, in which a score-optimal false positive is confirmed, given the order, or infinity.

    Runs the score recursion with the filter's own innovation covariance S: every adversary hits with d² = 0,
    every benign agent misses, one after another. The first adversary starts the track, so benign agents
    before it count from the second frame on. At the end of each frame the track is confirmed if L >= T_2,
    else deleted if L is more than `tentative_drop` below its own maximum over the frames' ends. The result is
    infinity where no frame can add to the score (S >= R), the track is deleted, or S is steady and the score
    does not increase.

    order                      "adversary" or "benign" per agent, in index order; "ABB" is short for the same
    noise_cov                  R[2, 2], m²; default sqrt(5) I, so that det R = 5
    initial_velocity_variance  per axis, (m/s)²
    process_noise              q of white-noise acceleration, m²/s³: Q = q [[dt³/3, dt²/2], [dt²/2, dt]]
    dt                         length of a frame, s
    """
    roles = _roles(order)
    if "adversary" not in roles:
        return math.inf
    tracker = _planar_filter(noise_cov, initial_velocity_variance, process_noise, dt)
    recursion = _ScoreRecursion(tracker, roles, p_detect, beta_fp)
    needed = score_to_confirm(p_detect=p_detect, beta_fp=beta_fp, beta_nt=beta_nt, alpha=alpha, beta=beta)
    return recursion.run(needed, tentative_drop)


@dataclass(frozen=True)
class _Filter:
    """A Kalman filter of the state [x, y, vx, vy], m and m/s, with position measurements."""

    initial_cov: Matrix  # P[4, 4] of a newborn track
    transition: Matrix  # F[4, 4]
    process_cov: Matrix  # Q[4, 4]
    noise_cov: Matrix  # R[2, 2], m²

    def predict(self, cov: Matrix) -> Matrix:
        """P <- F P Fᵀ + Q."""
        return self.transition @ cov @ self.transition.T + self.process_cov

    def innovation_cov(self, cov: Matrix) -> Matrix:
        """S = H P Hᵀ + R."""
        return cov[:2, :2] + self.noise_cov

    def update(self, cov: Matrix) -> Matrix:
        """P <- P - P Hᵀ S⁻¹ H P."""
        return cov - cov[:, :2] @ np.linalg.solve(self.innovation_cov(cov), cov[:2, :])


def _planar_filter(noise_cov: ArrayLike | None, velocity_variance: float, process_noise: float, dt: float) -> _Filter:
    """The constant-velocity filter with white-noise acceleration; raises ValueError for invalid arguments."""
    require_positive(dt=dt)
    require_non_negative(process_noise=process_noise, initial_velocity_variance=velocity_variance)
    noise = as_covariance("noise_cov", math.sqrt(5.0) * np.eye(2) if noise_cov is None else noise_cov)
    require("noise_cov", noise.tolist(), noise.shape == (2, 2), "a 2x2 matrix: positions are planar")
    initial_cov = np.kron(np.diag([0.0, velocity_variance]), np.eye(2))
    initial_cov[:2, :2] = noise
    per_axis = np.array([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]])
    transition = np.kron([[1.0, dt], [0.0, 1.0]], np.eye(2))
    return _Filter(initial_cov, transition, np.kron(process_noise * per_axis, np.eye(2)), noise)


class _ScoreRecursion:
    """Score and covariance of a false positive, agent by agent, when every hit has d² = 0."""

    def __init__(self, tracker: _Filter, roles: tuple[str, ...], p_detect: float, beta_fp: float) -> None:
        self.filter, self.roles = tracker, roles
        self.unit_gain = max_hit_gain(p_detect=p_detect, beta_fp=beta_fp, det_r=1.0)  # ΔL for det S = 1
        self.miss = math.log1p(-p_detect)

    def run(self, needed: float, tentative_drop: float) -> float:
        """The frame in which the score has gained `needed` since birth (nats), or infinity."""
        gained, cov = self._update(self.roles[self.roles.index("adversary") + 1 :], self.filter.initial_cov)
        frame, peak = 1, gained
        while gained < needed:
            if gained < peak - tentative_drop or self._largest_change() <= 0.0:
                return math.inf
            predicted = self.filter.predict(cov)
            change, updated = self._update(self.roles, predicted)
            if np.all(np.abs(updated - cov) <= _STEADY * np.abs(predicted)):
                return float(frame + math.ceil((needed - gained) / change)) if change > 0.0 else math.inf
            frame, gained, cov = frame + 1, gained + change, updated
            peak = max(peak, gained)
        return float(frame)

    def _update(self, roles: tuple[str, ...], cov: Matrix) -> tuple[float, Matrix]:
        """Score change by these agents, and the covariance[4, 4] after them."""
        change = 0.0
        for role in roles:
            if role == "benign":
                change += self.miss
            else:
                change += self._gain(self.filter.innovation_cov(cov))
                cov = self.filter.update(cov)
        return change, cov

    def _gain(self, innovation_cov: Matrix) -> float:
        """ΔL of a hit with d² = 0 (paper, Eq. 6)."""
        return self.unit_gain - 0.5 * math.log(np.linalg.det(innovation_cov))

    def _largest_change(self) -> float:
        """Score change of a frame in the limit S = R (paper, Prop. 2)."""
        gain = self._gain(self.filter.noise_cov)
        return self.roles.count("adversary") * gain + self.roles.count("benign") * self.miss


def _roles(order: Iterable[str]) -> tuple[str, ...]:
    """The role of each agent: "adversary" or "benign" (A and B for short)."""
    roles = tuple({"A": "adversary", "B": "benign"}.get(role, role) for role in order)
    for role in roles:
        known = role in ("adversary", "benign")
        require("order", role, known, '"adversary" or "benign" per agent, or a text such as "ABB"')
    return roles
