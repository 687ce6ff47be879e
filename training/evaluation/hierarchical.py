"""Mean and worst decile over runs and episodes, with intervals that count the chance of both.

The runs, such as training runs of different seeds, play the same episodes. A resample draws runs and, apart from
them, episodes, which are then the same for all runs drawn: two factors that cross, as in Owen, "The pigeonhole
bootstrap", 2007. With one run only the episodes are drawn, and the interval says nothing about other runs.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from trust_env.training.evaluation import statistics
from trust_env.training.evaluation.statistics import Bounds, percentile_bounds, resampled_counts


class Outcome(NamedTuple):
    """A metric over runs and episodes; the worst decile is the mean of the highest tenth, at least one value."""

    mean: Bounds
    worst_decile: Bounds

    def to_dict(self) -> dict[str, dict[str, float]]:
        return {"mean": self.mean._asdict(), "worst_decile": self.worst_decile._asdict()}


def outcome(values: np.ndarray, seed: int = 0) -> Outcome:
    """Mean and worst decile of values[runs, episodes] or [episodes], higher being worse, with 95 % intervals.

    ValueError: no values, or one that is not a finite number.
    """
    table = np.atleast_2d(np.asarray(values, dtype=float))
    if table.ndim != 2 or not table.size or not np.isfinite(table).all():
        raise ValueError(f"expected finite values [runs, episodes], at least one; got shape {table.shape}")
    descending = np.argsort(-table, axis=None, kind="stable")
    ordered = table.ravel()[descending]
    parts = [_statistics(ordered, weights[:, descending]) for weights in _resampled_weights(table.shape, seed)]
    means, worst = (np.concatenate(part) for part in zip(*parts))
    (mean,), (decile,) = _statistics(ordered, np.ones((1, ordered.size)))
    bounds = percentile_bounds(np.stack([ordered, ordered]), np.stack([means, worst]))
    return Outcome(Bounds(float(mean), *bounds[0]), Bounds(float(decile), *bounds[1]))


def _statistics(ordered: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and worst decile [R] of values[n] in falling order that count weights[R, n] times, n in all."""
    n = ordered.size
    worst = -(-n // 10)
    of_worst = np.diff(np.minimum(np.cumsum(weights, axis=1), worst), axis=1, prepend=0.0)
    return weights @ ordered / n, of_worst @ ordered / worst


def _resampled_weights(shape: tuple[int, int], seed: int) -> Iterator[np.ndarray]:
    """How often each value counts in a resample, float64[batch, runs * episodes], batch by batch."""
    size = shape[0] * shape[1]
    batch, streams = max(1, statistics.BATCH_NUMBERS // size), np.random.SeedSequence(seed).spawn(2)
    drawn = [resampled_counts(n, stream, batch) for n, stream in zip(shape, streams)]
    for runs, episodes in zip(*drawn):
        yield (runs[:, :, None] * episodes[:, None, :]).reshape(-1, size)
