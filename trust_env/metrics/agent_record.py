"""What trust in agents says of them over an episode: who is accused, and how adversaries rank."""

from __future__ import annotations

import math

import numpy as np

from trust_env.metrics.forecast_scores import Forecasts, auroc, average_precision, ratio

N_SCORES = 100  # equal parts of [0, 1]


class AgentRecord:
    """Trust in K agents over the frames of W worlds.

    Until its first edit an adversary is no other than a benign agent. With that frame its record begins anew, so that
    nothing of what trust did before tells for or against it.

    may_attack: bool[K], whose role is adversary. An agent is accused once its trust has been below `accuse_below` in
    `accuse_frames` frames in a row.
    """

    def __init__(self, n_worlds: int, may_attack: np.ndarray, accuse_below: float, accuse_frames: int):
        self._may_attack, self._accuse_below, self._accuse_frames = may_attack, accuse_below, accuse_frames
        shape = (n_worlds, len(may_attack))
        self._first_edit = np.full(shape, math.inf)
        self._trust_sum, self._opinions, self._frames_below = np.zeros((3, *shape))
        self._accused_from = np.full(shape, math.inf)
        self.forecasts = Forecasts(n_worlds)

    @property
    def _adversary(self) -> np.ndarray:
        """bool[W, K]"""
        return self._first_edit < math.inf

    def update(self, frame: int, trust: np.ndarray, first_edit: np.ndarray) -> None:
        """Take in frame `frame`, from 1: trust[W, K], NaN where there is no opinion; first_edit[W, K], 0: none."""
        self._begin_anew((first_edit > 0) & self._may_attack & ~self._adversary, first_edit)
        w, k = np.nonzero(~np.isnan(trust))
        self.forecasts.add(w, trust[w, k], ~self._adversary[w, k])
        self._trust_sum[w, k] += trust[w, k]
        self._opinions[w, k] += 1
        self._frames_below = np.where(trust < self._accuse_below, self._frames_below + 1, 0)
        accused = (self._frames_below >= self._accuse_frames) & np.isinf(self._accused_from)
        self._accused_from[accused] = frame - self._accuse_frames + 1

    def _begin_anew(self, starting: np.ndarray, first_edit: np.ndarray) -> None:
        self._first_edit[starting] = first_edit[starting]
        self._trust_sum[starting], self._opinions[starting], self._frames_below[starting] = 0, 0, 0
        self._accused_from[starting] = math.inf

    def result(self) -> dict[str, np.ndarray]:
        """The metrics of agents, float64[W] each."""
        mean, adversary = ratio(self._trust_sum, self._opinions), self._adversary
        w, k = np.nonzero(self._opinions)
        accusation_rate = self._rate_of_accused(adversary)
        return {
            "adversary_auroc": auroc(w, -mean[w, k], adversary[w, k], len(mean)),
            "adversary_average_precision": average_precision(-mean, adversary),
            "accusation_rate": accusation_rate,
            "false_accusation_rate": self._rate_of_accused(~adversary),
            "detection_delay": np.where(np.isnan(accusation_rate), np.nan, self._delay()),
            "agent_trust_brier": self.forecasts.brier(),
            "agent_trust_calibration_error": self.forecasts.calibration_error(),
        }

    def score_counts(self) -> np.ndarray:
        """How many agents of all worlds have a mean trust in each part of [0, 1], int64[2, N_SCORES]: adversaries, from
        their first edit on, and all others.
        """
        mean = ratio(self._trust_sum, self._opinions)
        parts = np.minimum(np.nan_to_num(mean) * N_SCORES, N_SCORES - 1).astype(np.int64)
        known = self._opinions > 0
        groups = (known & self._adversary, known & ~self._adversary)
        return np.stack([np.bincount(parts[group], minlength=N_SCORES) for group in groups])

    def _rate_of_accused(self, group: np.ndarray) -> np.ndarray:
        """Share of the agents of a group that are accused; NaN where there is no opinion of any of them."""
        accused, judged = np.isfinite(self._accused_from), (group & (self._opinions > 0)).any(axis=1)
        return ratio((accused & group).sum(1), np.where(judged, group.sum(1), 0))

    def _delay(self) -> np.ndarray:
        """Lower median of the adversaries' delays, frames; NaN where that is one who is never accused."""
        delay = np.where(self._adversary, self._accused_from, math.inf)
        delay[self._adversary] -= self._first_edit[self._adversary]
        middle = np.maximum(self._adversary.sum(1) - 1, 0) // 2
        found = np.take_along_axis(np.sort(delay, axis=1), middle[:, None], axis=1)[:, 0]
        return np.where(np.isfinite(found), found, np.nan)
