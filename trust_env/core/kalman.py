"""Constant-velocity Kalman filter with position measurements, on arrays in place. State `[x, y, vx, vy]`, H =
[I 0].
"""

from __future__ import annotations

from trust_env.core.jit import compiled, inlined


@inlined
def predict(mean, cov, dt, q):
    """x ← F x, P ← F P Fᵀ + Q with white-noise acceleration of density `q`, m²/s³ (Bar-Shalom et al. 2001,
    Eq. 6.2.2-4).

    mean: [4]; cov: [4, 4].
    """
    for a in range(2):
        mean[a] += dt * mean[a + 2]
    for a in range(2):
        for b in range(2):
            cov[a, b] += dt * (cov[a, b + 2] + cov[b, a + 2]) + dt * dt * cov[a + 2, b + 2]
    for a in range(2):
        for b in range(2):
            cov[a, b + 2] += dt * cov[a + 2, b + 2]
            cov[b + 2, a] = cov[a, b + 2]
        cov[a, a] += q * dt**3 / 3.0
        cov[a, a + 2] += q * dt * dt / 2.0
        cov[a + 2, a] += q * dt * dt / 2.0
        cov[a + 2, a + 2] += q * dt


@inlined
def innovation_cov(cov, noise, weight):
    """S = H P Hᵀ + R/w: its entries (xx, xy, yy) and its determinant."""
    xx, xy, yy = (
        cov[0, 0] + noise[0, 0] / weight,
        cov[0, 1] + noise[0, 1] / weight,
        cov[1, 1] + noise[1, 1] / weight,
    )
    return xx, xy, yy, xx * yy - xy * xy


@inlined
def update(mean, cov, dx, dy, xx, xy, yy, det):
    """x ← x + K ν, P ← P - K S Kᵀ with K = P Hᵀ S⁻¹.

    The innovation is ν = (dx, dy), its covariance S that of `innovation_cov`. mean: [4]; cov: [4, 4].
    """
    ixx, ixy, iyy = yy / det, -xy / det, xx / det
    p00, p01, p11 = cov[0, 0], cov[0, 1], cov[1, 1]
    p20, p21, p30, p31 = cov[2, 0], cov[2, 1], cov[3, 0], cov[3, 1]
    k00, k01 = (
        p00 * ixx + p01 * ixy,
        p00 * ixy + p01 * iyy,
    )  # rows of K, written out: the filter's hottest lines
    k10, k11 = p01 * ixx + p11 * ixy, p01 * ixy + p11 * iyy
    k20, k21 = p20 * ixx + p21 * ixy, p20 * ixy + p21 * iyy
    k30, k31 = p30 * ixx + p31 * ixy, p30 * ixy + p31 * iyy
    mean[0] += k00 * dx + k01 * dy
    mean[1] += k10 * dx + k11 * dy
    mean[2] += k20 * dx + k21 * dy
    mean[3] += k30 * dx + k31 * dy
    cov[0, 0] -= k00 * p00 + k01 * p01
    cov[1, 1] -= k10 * p01 + k11 * p11
    cov[2, 2] -= k20 * p20 + k21 * p21
    cov[3, 3] -= k30 * p30 + k31 * p31
    cov[0, 1] = cov[1, 0] = p01 - (k00 * p01 + k01 * p11)
    cov[0, 2] = cov[2, 0] = p20 - (k00 * p20 + k01 * p21)
    cov[0, 3] = cov[3, 0] = p30 - (k00 * p30 + k01 * p31)
    cov[1, 2] = cov[2, 1] = p21 - (k10 * p20 + k11 * p21)
    cov[1, 3] = cov[3, 1] = p31 - (k10 * p30 + k11 * p31)
    cov[2, 3] = cov[3, 2] = cov[2, 3] - (k20 * p30 + k21 * p31)


@compiled
def start(mean, cov, x, y, noise, weight, velocity_variance):
    """A new track on one detection: position variance R/w, velocity 0 with the given variance, (m/s)²."""
    for a in range(4):
        mean[a] = 0.0
        for b in range(4):
            cov[a, b] = 0.0
    mean[0], mean[1] = x, y
    for a in range(2):
        for b in range(2):
            cov[a, b] = noise[a, b] / weight
        cov[a + 2, a + 2] = velocity_variance
