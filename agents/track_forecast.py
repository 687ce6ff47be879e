"""The scores that the centre's tracker gives to phantoms, as far as adversaries can tell."""

from __future__ import annotations

import math

import numpy as np

from trust_env.scenario import Scenario
from trust_env.theory import initial_score, score_thresholds

_LEAST_LIFE = 2.0  # frames: a confirmed track that would live less without a report is urgent
_STATE = ("exists", "confirmed", "score", "peak", "position", "velocity", "p_xx", "p_xv", "p_vv")


class TrackForecast:
    """One track for every phantom [W, n, P]: the tracker's filter on the phantom's own reports, and its score
    (Hallyburton & Pajic 2024, Eqs. 4-7).

    Confirmation and deletion follow the rules `score` and `drop`, whatever those of the scenario are; both axes
    share one covariance, as noise is taken to be equal along them.
    """

    def __init__(self, scenario: Scenario, agents: np.ndarray, shape: tuple[int, ...]):
        tracker, members = scenario.tracker, [scenario.agent(int(k)) for k in agents]
        beliefs, covariances = [m.belief for m in members], [m.sensor.covariance for m in members]

        def by_agent(values: list[float]) -> np.ndarray:
            return np.array(values, dtype=np.float64).reshape(-1, 1)

        self.dt, self.process_noise = scenario.dt, tracker.process_noise
        self.velocity_variance, self.gate = tracker.initial_velocity_variance, -2.0 * math.log1p(-tracker.gate)
        self.variance = by_agent([0.5 * (r[0][0] + r[1][1]) for r in covariances])  # [n, 1], m²
        self.initial = by_agent(
            [initial_score(p_detect=b.p_detect, beta_fp=b.beta_fp, beta_nt=b.beta_nt) for b in beliefs]
        )
        self.hit_constant = by_agent([math.log(b.p_detect / (2.0 * math.pi * b.beta_fp)) for b in beliefs])
        self.miss_cost = by_agent([-math.log1p(-b.p_detect) for b in beliefs])
        self.confirm = score_thresholds(alpha=tracker.alpha, beta=tracker.beta)[1]
        self.drops = tracker.tentative_drop, tracker.confirmed_drop
        self.exists, self.confirmed = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
        self.score, self.peak = np.zeros(shape), np.zeros(shape)  # nats
        self.position, self.velocity = np.zeros((*shape, 2)), np.zeros((*shape, 2))  # m, m/s
        self.p_xx, self.p_xv, self.p_vv = np.zeros(shape), np.zeros(shape), np.zeros(shape)

    def clear(self, worlds: np.ndarray) -> None:
        """Drop all tracks of the worlds with these indices."""
        self.exists[worlds] = False
        self.confirmed[worlds] = False

    def state(self) -> dict[str, np.ndarray]:
        """The arrays [W, n, P, ...] that say all about the tracks, by name."""
        return {name: getattr(self, name) for name in _STATE}

    def life(self, watchers: np.ndarray) -> np.ndarray:
        """How many frames each track outlives without a report when `watchers` [W, n, P] look at it."""
        return (self.score - self.peak + self._drop()) / (np.maximum(watchers, 1) * self.miss_cost)

    def _drop(self) -> np.ndarray:
        """nats, how far below its peak the score of each track may fall."""
        return np.where(self.confirmed, self.drops[1], self.drops[0])

    def demand(self, watchers: np.ndarray) -> np.ndarray:
        """In which fraction of the frames a track needs a report to keep its score."""
        cost = np.maximum(watchers, 1) * self.miss_cost
        gain = self.hit_constant - np.log(2.0 * self.variance) + self.miss_cost  # against a miss, S = 2R
        return cost / np.maximum(gain, cost)

    def urgency(self, wanted: np.ndarray, watchers: np.ndarray, slots: np.ndarray) -> np.ndarray:
        """How much each phantom of wanted[W, n, P] needs a report now, when `slots` [n, 1] can be made in a frame.

        In this order: confirmed tracks of little life left, the shortest first; tentative ones, the highest score
        first; those to begin; other confirmed ones. No more are begun than can be confirmed and then kept alive. What
        is not wanted has -inf.
        """
        life = self.life(watchers)
        needed = (self.demand(watchers) * self.exists).sum(axis=2, keepdims=True)
        tentative = self.exists & ~self.confirmed
        absent = wanted & ~self.exists
        room = slots - np.ceil(needed) - tentative.sum(axis=2, keepdims=True)
        begin = absent & (np.cumsum(absent, axis=2) <= room)
        kept = np.where(life < _LEAST_LIFE, 3e6 - life, -life)
        others = np.where(tentative, 2e6 + self.score, np.where(begin, 1e6, -1e6))
        return np.where(wanted, np.where(self.confirmed, kept, others), -np.inf)

    def update(self, hit: np.ndarray, points: np.ndarray, watchers: np.ndarray) -> None:
        """One frame on: the phantoms of hit[W, n, P] are reported at points[W, n, P, 2] (m), by one of those that
        look at them.
        """
        self._predict()
        s, innovation = self.p_xx + self.variance, points - self.position
        distance2 = (innovation**2).sum(axis=-1) / s
        new, assigned = hit & ~self.exists, hit & self.exists & (distance2 <= self.gate)
        gain = self.hit_constant - np.log(s) - 0.5 * distance2
        misses = (np.maximum(watchers, 1) - (assigned | new)) * self.miss_cost
        score = np.where(new, self.initial, self.score + np.where(assigned, gain, 0.0)) - misses
        self._correct(assigned, s, innovation)
        self._start(new, points)
        self.confirmed = self.exists & ~new & (self.confirmed | (score >= self.confirm))
        self.peak, self.score = np.where(new, score, np.maximum(self.peak, score)), score
        self.exists = self.exists & (score >= self.peak - self._drop())
        self.confirmed = self.confirmed & self.exists

    def _predict(self) -> None:
        dt, q = self.dt, self.process_noise
        self.position = self.position + dt * self.velocity
        self.p_xx = self.p_xx + 2.0 * dt * self.p_xv + dt**2 * self.p_vv + q * dt**3 / 3.0
        self.p_xv = self.p_xv + dt * self.p_vv + q * dt**2 / 2.0
        self.p_vv = self.p_vv + q * dt

    def _correct(self, assigned: np.ndarray, s: np.ndarray, innovation: np.ndarray) -> None:
        """Kalman update of the tracks that are hit."""
        k_x, k_v = np.where(assigned, self.p_xx / s, 0.0), np.where(assigned, self.p_xv / s, 0.0)
        self.position = self.position + k_x[..., None] * innovation
        self.velocity = self.velocity + k_v[..., None] * innovation
        self.p_vv = self.p_vv - k_v * self.p_xv
        self.p_xv = (1.0 - k_x) * self.p_xv
        self.p_xx = (1.0 - k_x) * self.p_xx

    def _start(self, new: np.ndarray, points: np.ndarray) -> None:
        self.exists = self.exists | new
        self.position = np.where(new[..., None], points, self.position)
        self.velocity = np.where(new[..., None], 0.0, self.velocity)
        self.p_xx = np.where(new, self.variance, self.p_xx)
        self.p_xv = np.where(new, 0.0, self.p_xv)
        self.p_vv = np.where(new, self.velocity_variance, self.p_vv)
