"""Binomial tails against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from kernels import entry
from scipy.stats import binom

from trust_env.defenses.binomial import binomial_cdf, rounded


@entry
def fill(h, n, p, out):
    for i in range(out.shape[0]):
        out[i] = binomial_cdf(h[i], n[i], p[i])


@entry
def fill_rounded(counts, out):
    for i in range(out.shape[0]):
        out[i] = rounded(counts[i])


def cdf(h: np.ndarray, n: np.ndarray, p: np.ndarray) -> np.ndarray:
    out = np.zeros(len(h))
    fill(h.astype(np.int64), n.astype(np.int64), p.astype(float), out)
    return out


@pytest.mark.core
@pytest.mark.nojit
def test_probabilities_are_those_of_scipy():
    rng = np.random.default_rng(0)
    n = rng.integers(1, 60, 500)
    h, p = rng.integers(-1, n + 1), rng.uniform(0.01, 0.99, 500)
    assert cdf(h, n, p) == pytest.approx(binom.cdf(h, n, p), rel=1e-9, abs=1e-14)


def test_small_tails_keep_their_digits():
    n, h, p = np.array([20, 100, 1000, 1000]), np.array([0, 50, 500, 999]), np.array([0.9, 0.9, 0.7, 0.1])
    assert cdf(h, n, p) == pytest.approx(binom.cdf(h, n, p), rel=1e-8)


def test_by_hand():
    two, p = np.array([2, 2, 2, 2]), np.full(4, 0.9)
    assert cdf(np.array([-1, 0, 1, 2]), two, p) == pytest.approx([0.0, 0.01, 0.19, 1.0])


def test_halves_are_rounded_upwards():
    counts, out = np.array([0.0, 0.49, 0.5, 1.5, 2.5, 2.85]), np.zeros(6)
    fill_rounded(counts, out)
    assert out.tolist() == [0, 0, 1, 2, 3, 3]
