"""Validation of arguments: errors name the argument, its value and what was expected."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Matrix = NDArray[np.floating]


def require(name: str, value: object, valid: bool, expected: str) -> None:
    """Raise ValueError unless valid."""
    if not valid:
        raise ValueError(f"{name} = {value!r}: expected {expected}")


def require_probability(**values: float) -> None:
    """Raise ValueError unless all are in (0, 1)."""
    for name, value in values.items():
        require(name, value, 0.0 < value < 1.0, "a probability in (0, 1)")


def require_positive(**values: float) -> None:
    """Raise ValueError unless all are positive and finite."""
    for name, value in values.items():
        require(name, value, 0.0 < value < math.inf, "a positive number")


def require_non_negative(**values: float) -> None:
    """Raise ValueError unless all are finite and at least 0."""
    for name, value in values.items():
        require(name, value, 0.0 <= value < math.inf, "a number of at least 0")


def require_count(**values: int) -> None:
    """Raise ValueError unless all are whole numbers of at least 0."""
    for name, value in values.items():
        require(name, value, value >= 0 and value == int(value), "a count of at least 0")


def as_covariance(name: str, value: ArrayLike) -> Matrix:
    """The matrix as float64; raises ValueError unless it is symmetric and positive definite."""
    cov = np.asarray(value, dtype=np.float64)
    square = cov.ndim == 2 and cov.shape[0] == cov.shape[1] and bool(np.all(np.isfinite(cov)))
    valid = square and np.allclose(cov, cov.T) and float(np.linalg.eigvalsh(cov).min()) > 0.0
    require(name, cov.tolist(), valid, "a symmetric positive definite matrix")
    return cov
