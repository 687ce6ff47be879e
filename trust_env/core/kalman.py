"""Constant-velocity Kalman filter with position measurements, on arrays in place. State `[x, y, vx, vy]`, H = [I 0]."""

from __future__ import annotations

from trust_env.core.jit import compiled


@compiled
def predict(mean, cov, dt, q):
    """x ← F x, P ← F P Fᵀ + Q with white-noise acceleration of density `q`, m²/s³ (Bar-Shalom et al. 2001, Eq. 6.2.2-4).

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


@compiled
def innovation_cov(cov, noise, weight):
    """S = H P Hᵀ + R/w: its entries (xx, xy, yy) and its determinant."""
    xx, xy, yy = (
        cov[0, 0] + noise[0, 0] / weight,
        cov[0, 1] + noise[0, 1] / weight,
        cov[1, 1] + noise[1, 1] / weight,
    )
    return xx, xy, yy, xx * yy - xy * xy


@compiled
def update(mean, cov, dx, dy, xx, xy, yy, det):
    """x ← x + K ν, P ← P - K S Kᵀ with K = P Hᵀ S⁻¹, for the innovation ν = (dx, dy) and S of `innovation_cov`.

    mean: [4]; cov: [4, 4].
    """
    ixx, ixy, iyy = yy / det, -xy / det, xx / det
    for a in range(4):
        mean[a] += cov[a, 0] * (ixx * dx + ixy * dy) + cov[a, 1] * (ixy * dx + iyy * dy)
    p00, p10, p20, p30 = cov[0, 0], cov[1, 0], cov[2, 0], cov[3, 0]
    p01, p11, p21, p31 = cov[0, 1], cov[1, 1], cov[2, 1], cov[3, 1]
    column0, column1 = (p00, p10, p20, p30), (p01, p11, p21, p31)
    for a in range(4):
        k0, k1 = column0[a] * ixx + column1[a] * ixy, column0[a] * ixy + column1[a] * iyy
        for b in range(a, 4):
            cov[a, b] -= k0 * column0[b] + k1 * column1[b]
            cov[b, a] = cov[a, b]


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
