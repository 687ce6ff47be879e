"""Beta(α, β) beliefs: what a prior gives, mean and variance, and the update by a pseudomeasurement.

A pseudomeasurement, value v and confidence c, both in [0, 1], adds c v to α and c (1 - v) to β (Hallyburton &
Pajic 2024, Sec. IV).
"""

from __future__ import annotations

from trust_env.compiled.kernels import inlined


def beta_of(prior: tuple[float, float]) -> tuple[float, float]:
    """(α, β) of a prior (mean, precision)."""
    mean, precision = prior
    return mean * precision, (1 - mean) * precision


@inlined
def mean_of(belief):
    """E[τ] = α / (α + β)."""
    return belief[0] / (belief[0] + belief[1])


@inlined
def variance_of(belief):
    """Var[τ] = αβ / ((α + β)² (α + β + 1))."""
    total = belief[0] + belief[1]
    return belief[0] * belief[1] / (total * total * (total + 1.0))


@inlined
def update_belief(belief, value, confidence, bias, threshold):
    """α += c v, β += c (1 - v); with a negativity bias, α += n/(n+1) c v and β += n²/(n+1) c (1 - v), n =
    bias below the threshold, else 1.
    """
    up, down = 1.0, 1.0
    if bias > 0.0:
        n = bias if value < threshold else 1.0
        up, down = n / (n + 1.0), n * n / (n + 1.0)
    belief[0] += up * confidence * value
    belief[1] += down * confidence * (1.0 - value)
