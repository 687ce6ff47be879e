"""Means and interquartile means with bootstrap intervals, and differences by pairs.

The interquartile mean (Agarwal et al. 2021) hides the worst quarter of the episodes: it never stands alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Literal, NamedTuple

import numpy as np
from scipy.stats import bootstrap, trim_mean

CONFIDENCE = 0.95
RESAMPLES = 9999
_TAILS = (50.0 * (1.0 - CONFIDENCE), 50.0 * (1.0 + CONFIDENCE))  # per cent
_TRIMMED = 0.25  # of the episodes on each side
BATCH_NUMBERS = 2_000_000  # resampled numbers in memory at a time

Statistic = Literal["mean", "iqm"]


class Interval(NamedTuple):
    """An interquartile mean, or a difference of two, with its 95 % bootstrap interval."""

    iqm: float
    low: float
    high: float


class Bounds(NamedTuple):
    """A number with its 95 % bootstrap interval."""

    value: float
    low: float
    high: float


def interquartile_mean(values: np.ndarray, axis: int = -1) -> np.ndarray:
    """Mean of what remains without the lowest and the highest quarter."""
    return trim_mean(values, _TRIMMED, axis=axis)


def mean_intervals(metrics: Mapping[str, np.ndarray], seed: int = 0) -> dict[str, tuple[Bounds, Interval]]:
    """Mean and interquartile mean by metric, over the episodes that define it (not NaN); absent: none does.

    Metrics with as many defined episodes share their resamples.
    """
    defined = {name: np.sort(values[~np.isnan(values)]) for name, values in metrics.items()}
    found: dict[str, tuple[Bounds, Interval]] = {}
    for n in sorted({len(values) for values in defined.values()} - {0}):
        names = [name for name, values in defined.items() if len(values) == n]
        rows = np.stack([defined[name] for name in names])
        means, iqms = (percentile_bounds(rows, resampled) for resampled in _resampled_means(rows, seed))
        for row, name in enumerate(names):
            mean, iqm = float(rows[row].mean()), float(interquartile_mean(metrics[name][~np.isnan(metrics[name])]))
            found[name] = Bounds(mean, *means[row]), Interval(iqm, *iqms[row])
    return {name: found[name] for name in metrics if name in found}


def percentile_bounds(rows: np.ndarray, resampled: np.ndarray) -> list[tuple[float, float]]:
    """Percentile interval of every row; of a row of equal values, nothing but that value."""
    low, high = np.percentile(resampled, _TAILS, axis=1)
    constant = rows[:, 0] == rows[:, -1]
    low, high = np.where(constant, rows[:, 0], low), np.where(constant, rows[:, 0], high)
    return list(zip(low.tolist(), high.tolist()))


def _resampled_means(rows: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Means and interquartile means [R, RESAMPLES] of the resampled rows; `rows[R, n]`, each in rising order.

    In a resample the k-th value of a row in order counts as often as it is drawn, so that a resample is a row of
    counts, the same for all rows, and the middle half follows from their running sum.
    """
    n = rows.shape[1]
    cut = int(_TRIMMED * n)
    parts = []
    for counts in resampled_counts(n, seed):
        middle = np.diff(np.clip(np.cumsum(counts, axis=1), cut, n - cut), axis=1, prepend=cut)
        parts.append((rows @ counts.T / n, rows @ middle.T / (n - 2 * cut)))
    means, iqms = (np.concatenate(part, axis=1) for part in zip(*parts))
    return means, iqms


def resampled_counts(n: int, seed: int | np.random.SeedSequence, batch: int | None = None) -> Iterator[np.ndarray]:
    """How often each of n values is drawn in a resample, float64[batch, n], batch by batch."""
    rng, batch = np.random.default_rng(seed), batch or max(1, BATCH_NUMBERS // n)
    for first in range(0, RESAMPLES, batch):
        size = min(batch, RESAMPLES - first)
        drawn = rng.integers(0, n, (size, n)) + n * np.arange(size)[:, None]
        yield np.bincount(drawn.ravel(), minlength=size * n).reshape(size, n).astype(float)


def interval(values: np.ndarray, seed: int = 0) -> Interval | None:
    """The interquartile mean of a metric over the episodes that define it (not NaN); None: none does."""
    found = mean_intervals({"": values}, seed)
    return found[""][1] if found else None


def paired_difference(a: np.ndarray, b: np.ndarray, seed: int = 0) -> Interval | None:
    """IQM(a) - IQM(b) of episodes of the same seed: pairs are drawn, so that what they share cancels.

    Episodes in which either is undefined are ignored; None when none remains.
    """
    both = ~(np.isnan(a) | np.isnan(b))
    found = _bootstrapped((a[both], b[both]), seed, _difference)
    return None if found is None else Interval(found.value, found.low, found.high)


def paired_mean_difference(a: np.ndarray, b: np.ndarray, seed: int = 0) -> Bounds | None:
    """Mean of a - b over episodes of the same seed, as `paired_difference` does it for the interquartile means."""
    found = mean_intervals({"": a - b}, seed)
    return found[""][0] if found else None


def relative_mean_difference(a: np.ndarray, b: np.ndarray, seed: int = 0) -> Bounds | None:
    """(mean(a) - mean(b)) / mean(b) of episodes of the same seed, by pairs; None also where mean(b) is not above 0.

    The interval is NaN where the mean of b is not above 0 in a resample.
    """
    both = ~(np.isnan(a) | np.isnan(b))
    if not both.any() or b[both].mean() <= 0.0:
        return None
    rows = np.stack([a[both], b[both]])
    n = rows.shape[1]
    means = np.concatenate([rows @ counts.T / n for counts in resampled_counts(n, seed)], axis=1)
    edges = np.percentile(_relative(means), _TAILS).tolist()
    return Bounds(float(_relative(rows.mean(axis=1))), edges[0], edges[1])


def placed_between(values: np.ndarray, low: np.ndarray, high: np.ndarray, seed: int = 0) -> Bounds | None:
    """(mean(values) - mean(low)) / (mean(high) - mean(low)) of episodes of the same seed: 0 is as low, 1 as high.

    None where `high` is not above `low`; an interval of NaN where that is so in a resample.
    """
    rows = np.stack([values, low, high])
    rows = rows[:, ~np.isnan(rows).any(axis=0)]
    if not rows.size or rows[2].mean() <= rows[1].mean():
        return None
    n = rows.shape[1]
    means = np.concatenate([rows @ counts.T / n for counts in resampled_counts(n, seed)], axis=1)
    edges = np.percentile(_places(means), _TAILS).tolist()
    return Bounds(float(_places(rows.mean(axis=1))), edges[0], edges[1])


def simultaneous(rows: Iterable[np.ndarray], statistic: Statistic = "mean", seed: int = 0) -> list[Bounds]:
    """Intervals of several rows, float[episodes] each, that hold for all of them at once with 95 % probability.

    Row r: value_r ± q s_r, s_r the standard deviation of the resampled values, and q the 95 % quantile over the
    resamples of max_r |resampled_r - value_r| / s_r (the max-statistic bootstrap, as in Romano & Wolf 2005). Episodes
    are resampled for all rows together, so rows of the same seed may be as dependent as they are. ValueError: no row,
    rows of different lengths, or an episode that a row does not define.
    """
    found = [np.asarray(row, dtype=float) for row in rows]
    if not found or len({row.shape for row in found}) > 1 or found[0].ndim != 1 or not found[0].size:
        raise ValueError(f"rows must be of one length, of at least one episode; got {[row.shape for row in found]}")
    values = np.stack(found)
    if np.isnan(values).any():
        raise ValueError("rows must define every episode; got NaN")
    of = interquartile_mean if statistic == "iqm" else np.mean
    resampled = np.concatenate([of(values[:, picks], axis=-1) for picks in _resampled_episodes(values, seed)], axis=1)
    value, spread = of(values, axis=-1), resampled.std(axis=1, ddof=1)
    distance = np.abs(resampled - value[:, None])
    scaled = np.divide(distance, spread[:, None], out=np.zeros_like(distance), where=spread[:, None] > 0.0)
    reach = np.quantile(scaled.max(axis=0), CONFIDENCE) * spread
    return [Bounds(*each) for each in zip(value.tolist(), (value - reach).tolist(), (value + reach).tolist())]


def _resampled_episodes(rows: np.ndarray, seed: int) -> Iterator[np.ndarray]:
    """Which episodes of `rows[R, n]` are drawn in a resample, int[batch, n], batch by batch."""
    rng, batch, n = np.random.default_rng(seed), max(1, BATCH_NUMBERS // rows.size), rows.shape[1]
    for first in range(0, RESAMPLES, batch):
        yield rng.integers(0, n, (min(batch, RESAMPLES - first), n))


def _bootstrapped(samples: tuple[np.ndarray, ...], seed: int, statistic: Callable[..., np.ndarray]) -> Bounds | None:
    """The value of a statistic with its percentile bootstrap interval."""
    n = len(samples[0])
    if n == 0:
        return None
    value = float(statistic(*samples))
    if n == 1:  # nothing to resample
        return Bounds(value, value, value)
    found = bootstrap(
        samples, statistic, paired=True, vectorized=True, confidence_level=CONFIDENCE, method="percentile",
        n_resamples=RESAMPLES, batch=max(1, BATCH_NUMBERS // n), rng=np.random.default_rng(seed),
    ).confidence_interval  # fmt: skip
    return Bounds(value, float(found.low), float(found.high))


def _difference(a: np.ndarray, b: np.ndarray, axis: int = -1) -> np.ndarray:
    return interquartile_mean(a, axis) - interquartile_mean(b, axis)


def _relative(means: np.ndarray) -> np.ndarray:
    """means[0] over means[1], less 1; NaN where the latter is not above 0."""
    return (means[0] - means[1]) / np.where(means[1] > 0.0, means[1], np.nan)


def _places(means: np.ndarray) -> np.ndarray:
    """Where means[0] lies between means[1] (0) and means[2] (1); NaN where that is not higher."""
    whole = means[2] - means[1]
    return (means[0] - means[1]) / np.where(whole > 0.0, whole, np.nan)
