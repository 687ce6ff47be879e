"""Distances between a set of estimates and a set of truths."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from trust_env.world.point_sets import point_distances

_MAX_ORDER = 100


class Gospa(NamedTuple):
    """GOSPA and its parts: distance = (localisation + missed + false)^(1/order); the parts are in m^order."""

    distance: float
    localisation: float
    missed: float
    false: float


def gospa(estimates: Any, truths: Any, cutoff: float, order: float = 2.0) -> Gospa:
    """GOSPA with α = 2 of `estimates[n, 2]` and `truths[m, 2]`, in metres.

        d^p = min over assignments γ of  Σ_(i,j)∈γ d(x_i, y_j)^p + c^p/2 (n + m - 2|γ|)     c cutoff, p order

    (Rahmathullah, García-Fernández & Svensson 2017, Prop. 1). A truth without a pair costs c^p/2 as missed,
    an estimate without one c^p/2 as false. Equal to Stone Soup's; all parts of two empty sets are 0.
    ValueError for a wrong shape, a number that is not finite, cutoff <= 0, an order below 1 or above 100, or where
    c^p, the unit of the parts, is too large or too small for a float.
    """
    x, y = _points("estimates", estimates), _points("truths", truths)
    _check(cutoff, order)
    distance, _, localisation, pairs = point_distances(x, y, cutoff, order)
    unpaired = 0.5 * float(cutoff) ** order
    return Gospa(distance, localisation, unpaired * (len(y) - pairs), unpaired * (len(x) - pairs))


def ospa(estimates: Any, truths: Any, cutoff: float, order: float = 2.0) -> float:
    """OSPA of `estimates[n, 2]` and `truths[m, 2]`, in metres (Schuhmacher, Vo & Vo 2008, Eq. 3).

        d^p = (min over assignments of Σ min(d(x_i, y_j), c)^p + c^p |n - m|) / max(n, m)    c cutoff, p order

    0 of two empty sets, c when one is empty. Raises as `gospa` does. Stone Soup 1.9 picks the assignment that
    is best for p = 1 whatever p is, so that for p > 1 its value can lie above this minimum.
    """
    x, y = _points("estimates", estimates), _points("truths", truths)
    _check(cutoff, order)
    return point_distances(x, y, cutoff, order)[1]


def _points(name: str, values: Any) -> np.ndarray:
    """float64[n, 2]; an empty list is the empty set."""
    points = np.asarray(values, dtype=np.float64)
    points = points.reshape(0, 2) if points.shape == (0,) else points
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        raise ValueError(f"{name} must be finite positions of shape [n, 2]; got shape {list(points.shape)}")
    return points


def _check(cutoff: float, order: float) -> None:
    if not 0.0 < cutoff < np.inf:
        raise ValueError(f"cutoff must be a number above 0; got {cutoff!r}")
    if not 1.0 <= order <= _MAX_ORDER:
        raise ValueError(f"order must be a number from 1 to {_MAX_ORDER}; got {order!r}")
    if not -1000.0 < order * math.log2(cutoff) < 1000.0:
        raise ValueError(f"cutoff**order must lie between 2**-1000 and 2**1000; got {cutoff!r}**{order!r}")
