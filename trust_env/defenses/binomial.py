"""Tails of the binomial distribution, in kernels."""

from __future__ import annotations

import math

from trust_env.compiled.kernels import kernel


@kernel
def binomial_cdf(h, n, p):
    """P[Bin(n, p) ≤ h] for whole h and n, 0 < p < 1.

    The terms of the smaller tail are summed from the one nearest to the mean.
    """
    upper = h > n * p
    if upper:
        h, p = n - h - 1, 1.0 - p
    if h < 0:
        return 1.0 if upper else 0.0
    ways = math.lgamma(n + 1.0) - math.lgamma(h + 1.0) - math.lgamma(n - h + 1.0)
    term, total = math.exp(ways + h * math.log(p) + (n - h) * math.log1p(-p)), 0.0
    for i in range(h, -1, -1):
        total += term
        term *= i * (1.0 - p) / ((n - i + 1.0) * p)
    return 1.0 - total if upper else total


@kernel
def rounded(count):
    """The nearest whole number, halves upwards."""
    return math.floor(count + 0.5)
