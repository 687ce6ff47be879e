"""What the defense made of the confirmed tracks of an episode, in all and by who watches them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.special import expit

from trust_env.metrics.forecast_scores import Forecasts, auroc, ratio


class Tracks(NamedTuple):
    """Confirmed tracks, one entry for every track and frame."""

    world: np.ndarray  # uint32[S]
    trust: np.ndarray  # float64[S], NaN: no opinion
    score: np.ndarray  # float64[S], nats
    is_target: np.ndarray  # bool[S]
    rejected: np.ndarray  # bool[S], by the defense


class TrackRecord:
    """Confirmed tracks over the frames of W worlds. Memory: 22 bytes per confirmed track and frame."""

    def __init__(self, n_worlds: int):
        none = (np.empty(0, np.uint32), np.empty(0), np.empty(0), np.empty(0, bool), np.empty(0, bool))
        self._n_worlds, self._frames = n_worlds, [Tracks(*none)]

    def update(self, arrays: Any) -> None:
        """Take in the frame that the worlds' `arrays` hold."""
        w, j = np.nonzero(arrays.scored_confirmed)
        trust, score, label = arrays.track_trust[w, j], arrays.track_score[w, j], arrays.track_label[w, j]
        self._frames.append(Tracks(w.astype(np.uint32), trust, score, label >= 0, ~arrays.publish[w, j]))

    def result(self) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """The metrics of tracks, float64[W] each; and the bins of the trust in them, [W, 3, N_BINS]."""
        tracks, n = Tracks(*map(np.concatenate, zip(*self._frames))), self._n_worlds
        existence, trust = Forecasts(n), Forecasts(n)
        existence.add(tracks.world, expit(tracks.score), tracks.is_target)
        judged = ~np.isnan(tracks.trust)
        sample = tracks.world[judged], tracks.trust[judged], tracks.is_target[judged]
        trust.add(*sample)
        return {
            "track_auroc": auroc(*sample, n),
            "true_track_rejection_rate": self._rejection_rate(tracks, tracks.is_target),
            "false_track_rejection_rate": self._rejection_rate(tracks, ~tracks.is_target),
            "existence_brier": existence.brier(),
            "track_trust_brier": trust.brier(),
            "track_trust_calibration_error": trust.calibration_error(),
        }, trust.bins

    def _rejection_rate(self, tracks: Tracks, of_kind: np.ndarray) -> np.ndarray:
        confirmed = np.bincount(tracks.world[of_kind], minlength=self._n_worlds)
        rejected = np.bincount(tracks.world[of_kind & tracks.rejected], minlength=self._n_worlds)
        return ratio(rejected, confirmed)
