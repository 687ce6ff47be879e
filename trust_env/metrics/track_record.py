"""What the defense made of the confirmed tracks of an episode."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.special import expit

from trust_env.metrics.forecast_scores import Forecasts, auroc, ratio


class Tracks(NamedTuple):
    """Confirmed tracks, one entry for every track and frame."""

    world: np.ndarray  # uint32[S]
    stratum: np.ndarray  # uint32[S], by whom it is watched: `pack`
    trust: np.ndarray  # float64[S], NaN: no opinion
    score: np.ndarray  # float64[S], nats
    is_target: np.ndarray  # bool[S]
    rejected: np.ndarray  # bool[S], by the defense
    shown_false: np.ndarray  # bool[S], a false track of the picture
    shown_injected: np.ndarray  # bool[S], one that injections made


class TrackRecord:
    """Confirmed tracks over the frames of W worlds. Memory: 28 bytes per confirmed track and frame."""

    def __init__(self, n_worlds: int):
        self._n_worlds = n_worlds
        none = [np.empty(0, dtype) for dtype in ("u4", "u4", "f8", "f8", "?", "?", "?", "?")]
        self._frames = [Tracks(*none)]

    def update(self, arrays: Any) -> None:
        """Take in the frame that the worlds' `arrays` hold."""
        at = np.nonzero(arrays.scored_confirmed)
        shown_false = arrays.published[at] & (arrays.track_target[at] < 0)
        self._frames.append(
            Tracks(
                at[0].astype(np.uint32),
                pack(arrays.track_watchers[at]),
                arrays.track_trust[at],
                arrays.track_score[at],
                arrays.track_label[at] >= 0,
                ~arrays.publish[at],
                shown_false,
                shown_false & arrays.track_injected[at],
            )
        )

    def tracks(self) -> Tracks:
        """All of them so far."""
        self._frames = [Tracks(*map(np.concatenate, zip(*self._frames)))]
        return self._frames[0]

    def trust_forecasts(self) -> Forecasts:
        """Trust in tracks as a forecast that they are targets."""
        found, tracks = Forecasts(self._n_worlds), self.tracks()
        judged = ~np.isnan(tracks.trust)
        found.add(tracks.world[judged], tracks.trust[judged], tracks.is_target[judged])
        return found

    def result(self) -> dict[str, np.ndarray]:
        """The metrics of tracks, float64[W] each."""
        tracks, trust, existence = self.tracks(), self.trust_forecasts(), Forecasts(self._n_worlds)
        existence.add(tracks.world, expit(tracks.score), tracks.is_target)
        judged = ~np.isnan(tracks.trust)
        sample = tracks.world[judged], tracks.trust[judged], tracks.is_target[judged]
        return {
            "track_auroc": auroc(*sample, self._n_worlds),
            "true_track_rejection_rate": self._rejection_rate(tracks, tracks.is_target),
            "false_track_rejection_rate": self._rejection_rate(tracks, ~tracks.is_target),
            "existence_brier": existence.brier(),
            "track_trust_brier": trust.brier(),
            "track_trust_calibration_error": trust.calibration_error(),
        }

    def _rejection_rate(self, tracks: Tracks, of_kind: np.ndarray) -> np.ndarray:
        confirmed = np.bincount(tracks.world[of_kind], minlength=self._n_worlds)
        rejected = np.bincount(tracks.world[of_kind & tracks.rejected], minlength=self._n_worlds)
        return ratio(rejected, confirmed)


_BITS = 16  # of a packed number of agents


def pack(watchers: np.ndarray) -> np.ndarray:
    """Watching adversaries and benign agents, watchers[S, 2], as one number: uint32[S]."""
    return ((watchers[:, 0] << _BITS) | watchers[:, 1]).astype(np.uint32)


def unpack(stratum: int) -> tuple[int, int]:
    """Watching adversaries and benign agents of a stratum."""
    return stratum >> _BITS, stratum & ((1 << _BITS) - 1)
