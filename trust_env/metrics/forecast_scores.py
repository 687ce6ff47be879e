"""How good numbers in [0, 1] are as forecasts of yes or no: ranking, Brier score, calibration.

What a world gives no ground for is NaN, never zero or one half.
"""

from __future__ import annotations

import numpy as np

N_BINS = 10
COUNT, FORECAST, OUTCOME = range(3)  # of a bin: samples, sum of their forecasts, how many came true


def ratio(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    """Quotient, NaN where the denominator is zero."""
    out = np.full(np.shape(denominator), np.nan)
    return np.divide(numerator, denominator, out=out, where=np.asarray(denominator) != 0)


def auroc(worlds: np.ndarray, scores: np.ndarray, positive: np.ndarray, n_worlds: int) -> np.ndarray:
    """P(a positive scores higher than a negative) + P(they are equal)/2, of each world: float64[n_worlds].

    Sample s belongs to `worlds[s]`. NaN for a world without a positive or without a negative. From
    ranks (Mann & Whitney 1947): (Σ ranks of the positives - P(P+1)/2) / (P N); equal scores share a rank.
    """
    order = np.lexsort((scores, worlds))
    worlds, scores, positive = worlds[order], scores[order], positive[order].astype(bool)
    first_of_world = np.searchsorted(worlds, worlds)
    rank = _mean_ranks(worlds, scores) - first_of_world
    positives = np.bincount(worlds[positive], minlength=n_worlds).astype(float)
    negatives = np.bincount(worlds[~positive], minlength=n_worlds).astype(float)
    rank_sum = np.bincount(worlds[positive], weights=rank[positive], minlength=n_worlds)
    return ratio(rank_sum - positives * (positives + 1) / 2, positives * negatives)


def _mean_ranks(worlds: np.ndarray, scores: np.ndarray) -> np.ndarray:
    """Ranks from 1 of samples in order; equal ones of a world share their mean."""
    new = np.ones(len(scores), dtype=bool)
    new[1:] = (worlds[1:] != worlds[:-1]) | (scores[1:] != scores[:-1])
    starts = np.flatnonzero(new)
    ends = np.append(starts[1:], len(scores))
    return np.repeat((starts + 1 + ends) / 2.0, ends - starts)


def average_precision(scores: np.ndarray, positive: np.ndarray) -> np.ndarray:
    """Mean over the positives of the precision among all that score at least as high: float64[n_worlds].

    scores[n_worlds, n], NaN: no sample; positive[n_worlds, n]. NaN for a world without a positive or without a
    negative. As scikit-learn's: no interpolation, and equal scores enter together.
    """
    known = ~np.isnan(scores)
    positives, negatives = known & positive, known & ~positive
    total = np.zeros(len(scores))
    for k in range(scores.shape[1]):
        above = known & (scores >= scores[:, k : k + 1])
        total += np.where(positives[:, k], ratio((above & positive).sum(1), above.sum(1)), 0.0)
    return ratio(total, np.where(negatives.any(1), positives.sum(1), 0))


class Forecasts:
    """Sums over forecasts and outcomes, from which Brier score and calibration error of each world follow."""

    def __init__(self, n_worlds: int):
        self.squares = np.zeros(n_worlds)
        self.bins = np.zeros((n_worlds, 3, N_BINS))  # COUNT, FORECAST, OUTCOME

    def add(self, worlds: np.ndarray, forecasts: np.ndarray, outcomes: np.ndarray) -> None:
        """Samples s: `forecasts[s]` in [0, 1] of `outcomes[s]` (bool), in world `worlds[s]`."""
        n = len(self.squares)
        self.squares += np.bincount(worlds, weights=(forecasts - outcomes) ** 2, minlength=n)
        places = worlds * N_BINS + np.minimum((forecasts * N_BINS).astype(np.int64), N_BINS - 1)
        for row, weights in ((COUNT, None), (FORECAST, forecasts), (OUTCOME, outcomes)):
            self.bins[:, row] += np.bincount(places, weights, minlength=n * N_BINS).reshape(n, N_BINS)

    def brier(self) -> np.ndarray:
        """Mean of (forecast - outcome)² (Brier 1950)."""
        return ratio(self.squares, self.bins[:, COUNT].sum(axis=-1))

    def calibration_error(self) -> np.ndarray:
        return calibration_error(self.bins)


def calibration_error(bins: np.ndarray) -> np.ndarray:
    """Expected calibration error, Σ_b n_b/n |mean forecast - mean outcome| over equal bins; `bins[..., 3, N_BINS]`."""
    return ratio(np.abs(bins[..., FORECAST, :] - bins[..., OUTCOME, :]).sum(-1), bins[..., COUNT, :].sum(-1))
