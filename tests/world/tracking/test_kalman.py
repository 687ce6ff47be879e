"""The Kalman filter against the textbook, and where rounding would make a variance negative."""

from __future__ import annotations

import numpy as np
import pytest
from kernels import entry

from trust_env.world.tracking import kalman

pytestmark = [pytest.mark.core, pytest.mark.nojit]


@entry
def run_predict(mean, cov, dt, q):
    kalman.predict(mean, cov, dt, q)


@entry
def run_update(mean, cov, nu, noise):
    rxx, rxy, ryy = noise[0, 0], noise[0, 1], noise[1, 1]
    xx, xy, yy, det = kalman.innovation_cov(cov, rxx, rxy, ryy)
    kalman.update(mean, cov, nu[0], nu[1], (rxx, rxy, ryy), (yy / det, -xy / det, xx / det), det)


def draw_noise(rng: np.random.Generator, least: float, most: float, correlation: float) -> np.ndarray:
    """R[2, 2]."""
    x, y = 10.0 ** rng.uniform(np.log10(least), np.log10(most), 2)
    return np.array([[x * x, correlation * x * y], [correlation * x * y, y * y]])


def is_positive_semi_definite(cov: np.ndarray) -> bool:
    scale = np.sqrt(np.diag(cov))
    correlation = cov / scale[:, None] / scale
    return bool((np.diag(cov) > 0).all() and (cov == cov.T).all() and np.linalg.eigvalsh(correlation).min() > -1e-9)


def test_an_update_is_that_of_the_textbook():
    """x + K ν and Joseph's form (I - K H) P (I - K H)ᵀ + K R Kᵀ."""
    rng = np.random.default_rng(1)
    h = np.eye(2, 4)
    for _ in range(200):
        root = rng.normal(size=(4, 4))
        mean, cov, nu = rng.normal(size=4), root @ root.T + 0.1 * np.eye(4), rng.normal(size=2)
        noise = draw_noise(rng, 0.1, 10.0, rng.uniform(-0.9, 0.9))
        gain = cov @ h.T @ np.linalg.inv(h @ cov @ h.T + noise)
        rest = np.eye(4) - gain @ h
        expected = mean + gain @ nu, rest @ cov @ rest.T + gain @ noise @ gain.T
        run_update(mean, cov, nu, noise)
        np.testing.assert_allclose(mean, expected[0], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(cov, expected[1], rtol=1e-9, atol=1e-12)


def test_noise_far_below_the_prediction_leaves_the_noise():
    """sigma 1e-6 m, dt 10 s, q 100 m^2/s^3: the variance of x was negative."""
    noise, mean, cov = 1e-12 * np.eye(2), np.zeros(4), np.diag([1e-12, 1e-12, 36.0, 36.0])
    for _ in range(20):
        run_predict(mean, cov, 10.0, 100.0)
        run_update(mean, cov, np.array([0.3, -0.2]), noise)
        assert is_positive_semi_definite(cov)
        np.testing.assert_allclose(cov[:2, :2], noise, rtol=1e-9, atol=1e-24)


def test_covariances_stay_positive_semi_definite_over_the_whole_range_of_scenarios():
    rng = np.random.default_rng(2)
    for _ in range(300):
        dt, q = 10.0 ** rng.uniform(-6, 6), rng.choice([0.0, 10.0 ** rng.uniform(-12, 9)])
        noises = [draw_noise(rng, 1e-6, 1e9, rng.choice([0.0, 0.5, -0.9, 0.999999])) for _ in range(3)]
        mean, cov = np.zeros(4), np.zeros((4, 4))
        cov[:2, :2], cov[2:, 2:] = noises[0], 10.0 ** rng.uniform(-12, 18) * np.eye(2)
        for _ in range(10):
            run_predict(mean, cov, dt, q)
            for noise in noises:
                run_update(mean, cov, rng.normal(size=2), noise)
                assert is_positive_semi_definite(cov)
