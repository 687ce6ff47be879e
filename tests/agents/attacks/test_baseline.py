"""The random policy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from attack_runs import play

pytestmark = pytest.mark.core


def test_random_is_uniform() -> None:
    actions = np.array([a[:, :2] for _, a in play("patrol", "random", 20, 32)])
    assert actions.size == 20 * 32 * 2 * 28
    values = actions.reshape(-1)
    # Standard error of a mean of U(-1, 1): 1/sqrt(3 n); of the share in a quarter: sqrt(3/16 n).
    assert abs(values.mean()) < 5 / math.sqrt(3 * values.size)
    shares = np.histogram(values, bins=4, range=(-1, 1))[0] / values.size
    assert np.abs(shares - 0.25).max() < 5 * math.sqrt(3 / 16 / values.size)
    assert len(np.unique(values)) > 0.99 * values.size
