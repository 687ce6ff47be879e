"""Tracks and targets by stratum: how many adversaries and how many benign agents watch them.

All episodes of a batch are taken together, as most strata are rare in any one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from trust_env.metrics.track_record import Tracks, unpack

Watchers = tuple[int, int]  # K_a adversaries, K_b benign agents

TRUST_STEPS = 1000  # into which the range of trust is divided for the AUROC of a stratum


class Stratum(NamedTuple):
    """What became of the tracks and targets that so many agents watch; means over all frames of all episodes.

    track_auroc ranks over all episodes; trusts in the same thousandth of the range count as equal. NaN: absent, as in
    `METRICS`.
    """

    adversaries: int  # that watch: from their first edit on
    benign: int
    confirmed_tracks_per_frame: float
    damage_per_frame: float
    false_tracks_per_frame: float
    injected_tracks_per_frame: float
    missing_targets_per_frame: float
    track_trust_brier: float
    track_auroc: float


@dataclass(frozen=True)
class StratumSums:
    """Numbers of tracks and targets of one stratum, each counted once a frame."""

    confirmed: int
    false: int
    injected: int
    missing: int
    squares: float  # (trust - outcome)², added up
    trust: np.ndarray  # int64[2, TRUST_STEPS], of false and of true tracks

    def __add__(self, other: StratumSums) -> StratumSums:
        return StratumSums(**{name: value + getattr(other, name) for name, value in vars(self).items()})

    def means(self, watchers: Watchers, frames: int) -> Stratum:
        """Means over so many frames."""
        judged = int(self.trust.sum())
        return Stratum(
            adversaries=watchers[0],
            benign=watchers[1],
            confirmed_tracks_per_frame=self.confirmed / frames,
            damage_per_frame=(self.false + self.missing) / frames,
            false_tracks_per_frame=self.false / frames,
            injected_tracks_per_frame=self.injected / frames,
            missing_targets_per_frame=self.missing / frames,
            track_trust_brier=self.squares / judged if judged else math.nan,
            track_auroc=_auroc_of_steps(self.trust),
        )


Strata = dict[Watchers, StratumSums]


def sum_strata(tracks: Tracks, missing: np.ndarray) -> Strata:
    """Sums by stratum of confirmed tracks and of missing targets, `missing[S]` their strata, in rising order."""
    strata, place = np.unique(np.concatenate([tracks.stratum, missing]), return_inverse=True)
    of_track, of_missing, n = place[: len(tracks.stratum)], place[len(tracks.stratum) :], len(strata)
    judged = ~np.isnan(tracks.trust)
    trust, is_target, of_judged = tracks.trust[judged], tracks.is_target[judged], of_track[judged]
    step = np.minimum((trust * TRUST_STEPS).astype(np.int64), TRUST_STEPS - 1)
    cell = (of_judged * 2 + is_target) * TRUST_STEPS + step
    counts = (
        np.bincount(of_track, minlength=n),
        np.bincount(of_track[tracks.shown_false], minlength=n),
        np.bincount(of_track[tracks.shown_injected], minlength=n),
        np.bincount(of_missing, minlength=n),
        np.bincount(of_judged, weights=(trust - is_target) ** 2, minlength=n),
    )
    steps = np.bincount(cell, minlength=2 * TRUST_STEPS * n).reshape(n, 2, TRUST_STEPS)
    confirmed, false, injected, lacking, squares = (count.tolist() for count in counts)
    return {
        unpack(int(s)): StratumSums(confirmed[i], false[i], injected[i], lacking[i], squares[i], steps[i])
        for i, s in enumerate(strata)
    }


def merge_strata(parts: Iterable[Strata]) -> Strata:
    """The sums of several batches together, in rising order."""
    found: Strata = {}
    for part in parts:
        for watchers, sums in part.items():
            found[watchers] = found[watchers] + sums if watchers in found else sums
    return dict(sorted(found.items()))


def _auroc_of_steps(counts: np.ndarray) -> float:
    """P(a true track is trusted more than a false one), equal steps counting half; `counts[2, TRUST_STEPS]`."""
    false, true = counts
    if not false.any() or not true.any():
        return math.nan
    below = np.cumsum(false) - false
    return float((true * (below + 0.5 * false)).sum() / (true.sum() * false.sum()))
