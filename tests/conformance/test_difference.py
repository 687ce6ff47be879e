"""The first difference between two values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium import spaces

from trust_env.conformance.difference import difference


@pytest.mark.parametrize(
    ("a", "b", "found"),
    [
        ({"x": [1.0, float("nan")]}, {"x": [1.0, float("nan")]}, None),
        (np.array([1.0, np.nan]), np.array([1.0, np.nan]), None),
        (np.array(["a"], object), np.array(["a"], object), None),
        (spaces.Discrete(2), spaces.Discrete(2), None),
        (object(), object(), None),
        (1, 1.0, ("", "1 (int)", "1.0 (float)")),
        (np.float32(1), 1.0, ("", "np.float32(1.0) (float32)", "1.0 (float)")),
        ({"x": (1, 2)}, {"x": (1, 3)}, ("['x'][1]", "2", "3")),
        ({"x": 1}, {"y": 1}, ("", "keys ['x']", "keys ['y']")),
        ([1], [1, 2], ("", "[1]", "[1, 2]")),
        (np.zeros((2, 2)), np.eye(2), ("[0, 0]", "0.0", "1.0")),
        (np.zeros(2), np.zeros(2, np.float32), ("", "float64[2]", "float32[2]")),
    ],
)
def test_first_difference_has_path_and_values(a: Any, b: Any, found: tuple[str, str, str] | None) -> None:
    assert difference(a, b) == found
