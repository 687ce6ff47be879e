"""What is reported of a metric of a cell: mean, mean of the worst tenth, interquartile mean, and how often never."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from trust_env.metrics import METRICS, Metric
from trust_env.training.evaluation.statistics import Interval, mean_intervals


class Summary(NamedTuple):
    """A metric over the episodes that define it: NaN where no number says it.

    low, high: the 95 % bootstrap interval of the interquartile mean; mean_low, mean_high: that of the mean. never: of
    the episodes in which the metric has a value or means "never", the share of the latter; None: it cannot mean it.
    """

    mean: float
    worst_decile: float  # mean of the worst tenth, NaN where "never" is among it
    iqm: float
    low: float
    high: float
    mean_low: float
    mean_high: float
    never: float | None = None

    @property
    def interval(self) -> Interval:
        """The interquartile mean with its interval."""
        return Interval(self.iqm, self.low, self.high)

    def to_dict(self) -> dict[str, Any]:
        """Plain values only: null for NaN, `never` only where the metric can mean it."""
        values = without_nan(self._asdict())
        return {name: value for name, value in values.items() if name != "never" or self.never is not None}


def without_nan(values: Mapping[str, float | None]) -> dict[str, float | None]:
    """The same with None for NaN."""
    return {name: None if value is None or math.isnan(value) else value for name, value in values.items()}


def summarise(metrics: Mapping[str, np.ndarray]) -> dict[str, Summary]:
    """A summary of every metric, float64[episodes]; one that no episode defines, nor means "never", is absent."""
    intervals, found = mean_intervals(metrics), {}
    for name, values in metrics.items():
        never = is_never(METRICS[name], metrics)
        if name in intervals:
            mean, iqm = intervals[name]
            worst = worst_decile_mean(values, never, METRICS[name].worse)
            found[name] = Summary(mean.value, worst, *iqm, mean.low, mean.high, _share(never, values))
        elif never is not None and never.any():
            found[name] = Summary(*[math.nan] * 7, never=1.0)
    return found


def is_never(metric: Metric, metrics: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """In which episodes an absent value means "never", bool[episodes]; None: it cannot."""
    if metric.never_where is None:
        return None
    return np.isnan(metrics[metric.name]) & ~np.isnan(metrics[metric.never_where])


def _share(never: np.ndarray | None, values: np.ndarray) -> float | None:
    return None if never is None else float(never.sum() / (never.sum() + (~np.isnan(values)).sum()))


def worst_decile_mean(values: np.ndarray, never: np.ndarray | None, worse: str) -> float:
    """Mean of the worst tenth of the episodes, at least one; NaN where one in which the metric means "never", which
    is higher than any number, is among it. `worse`: "higher" or "lower".
    """
    values = values if never is None else np.where(never, np.inf, values)
    ordered = np.sort(values[~np.isnan(values)])
    count = math.ceil(len(ordered) / 10)
    mean = float((ordered[:count] if worse == "lower" else ordered[-count:]).mean())
    return mean if math.isfinite(mean) else math.nan
