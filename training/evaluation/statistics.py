"""Interquartile means with bootstrap intervals, and paired differences (Agarwal et al. 2021)."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.stats import bootstrap, trim_mean

CONFIDENCE = 0.95
_BATCH_NUMBERS = 2_000_000  # resampled numbers in memory at a time


class Interval(NamedTuple):
    """An interquartile mean, or a difference of two, with its 95 % bootstrap interval."""

    iqm: float
    low: float
    high: float


def interquartile_mean(values: np.ndarray, axis: int = -1) -> np.ndarray:
    """Mean of what remains without the lowest and the highest quarter."""
    return trim_mean(values, 0.25, axis=axis)


def interval(values: np.ndarray, seed: int = 0) -> Interval | None:
    """The interquartile mean of a metric over the episodes that define it (not NaN); None: none does."""
    return _bootstrapped((values[~np.isnan(values)],), seed)


def paired_difference(a: np.ndarray, b: np.ndarray, seed: int = 0) -> Interval | None:
    """IQM(a) - IQM(b) of episodes of the same seed: pairs are drawn, so that what they share cancels.

    Episodes in which either is undefined are ignored; None when none remains.
    """
    both = ~(np.isnan(a) | np.isnan(b))
    return _bootstrapped((a[both], b[both]), seed)


def relative_difference(a: np.ndarray, b: np.ndarray, seed: int = 0) -> Interval | None:
    """(IQM(a) - IQM(b)) / IQM(b) of episodes of the same seed, by pairs; None also where IQM(b) is 0."""
    both = ~(np.isnan(a) | np.isnan(b))
    if not both.any() or interquartile_mean(b[both]) <= 0.0:
        return None
    return _bootstrapped((a[both], b[both]), seed, _relative_difference)


def _bootstrapped(
    samples: tuple[np.ndarray, ...], seed: int, statistic: Callable[..., np.ndarray] | None = None
) -> Interval | None:
    """The value of a statistic (by default `_difference`) with its percentile bootstrap interval."""
    n, statistic = len(samples[0]), statistic or _difference
    if n == 0:
        return None
    value = float(statistic(*samples))
    if n == 1:  # nothing to resample
        return Interval(value, value, value)
    found = bootstrap(
        samples, statistic, paired=True, vectorized=True, confidence_level=CONFIDENCE, method="percentile",
        batch=max(1, _BATCH_NUMBERS // n), rng=np.random.default_rng(seed),
    ).confidence_interval  # fmt: skip
    return Interval(value, float(found.low), float(found.high))


def _difference(*samples: np.ndarray, axis: int = -1) -> np.ndarray:
    """IQM of the first sample, less that of the second if there is one."""
    means = [interquartile_mean(sample, axis) for sample in samples]
    return means[0] - means[1] if len(means) > 1 else means[0]


def _relative_difference(a: np.ndarray, b: np.ndarray, axis: int = -1) -> np.ndarray:
    base = interquartile_mean(b, axis)
    return (interquartile_mean(a, axis) - base) / np.maximum(base, np.finfo(float).tiny)
