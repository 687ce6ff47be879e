"""Constant-velocity Kalman filter with position measurements, on arrays in place.

The state is `[x, y, vx, vy]`, H = [I 0].
"""

from __future__ import annotations

from trust_env.compiled.kernels import inlined, kernel

_PRECISE = 1e-6  # |R| / |S| below which P - K S Kᵀ loses too many digits
_ROUNDING = 2.0**-46  # more than rounding takes from a variance in an update, where x and y are uncorrelated


@inlined
def predict(mean, cov, dt, q):
    """x ← F x, P ← F P Fᵀ + Q with white-noise acceleration of density `q`, m²/s³ (Bar-Shalom et al. 2001,
    Eq. 6.2.2-4).

    mean: [4]; cov: [4, 4], in blocks of position and velocity [[A, B], [Bᵀ, C]].
    """
    b00, b01, b10, b11 = cov[0, 2], cov[0, 3], cov[1, 2], cov[1, 3]
    c00, c01, c11 = cov[2, 2], cov[2, 3], cov[3, 3]
    a00 = cov[0, 0] + dt * (b00 + b00) + dt * dt * c00 + q * dt * dt * dt / 3.0
    a01 = cov[0, 1] + dt * (b01 + b10) + dt * dt * c01
    a11 = cov[1, 1] + dt * (b11 + b11) + dt * dt * c11 + q * dt * dt * dt / 3.0
    b00, b01 = b00 + dt * c00 + q * dt * dt / 2.0, b01 + dt * c01
    b10, b11 = b10 + dt * c01, b11 + dt * c11 + q * dt * dt / 2.0
    mean[0], mean[1] = mean[0] + dt * mean[2], mean[1] + dt * mean[3]
    cov[0, 0], cov[0, 1], cov[0, 2], cov[0, 3] = a00, a01, b00, b01
    cov[1, 0], cov[1, 1], cov[1, 2], cov[1, 3] = a01, a11, b10, b11
    cov[2, 0], cov[2, 1], cov[2, 2] = b00, b10, c00 + q * dt
    cov[3, 0], cov[3, 1], cov[3, 3] = b01, b11, c11 + q * dt


@inlined
def innovation_cov(cov, rxx, rxy, ryy):
    """S = H P Hᵀ + R: its entries (xx, xy, yy) and its determinant."""
    xx, xy, yy = cov[0, 0] + rxx, cov[0, 1] + rxy, cov[1, 1] + ryy
    return xx, xy, yy, xx * yy - xy * xy


@inlined
def update(mean, cov, dx, dy, noise, s_inverse, det):
    """x ← x + K ν, P ← P - K S Kᵀ with K = P Hᵀ S⁻¹.

    The innovation is ν = (dx, dy); R and S⁻¹ are given by their entries (xx, xy, yy), S also by its determinant.
    mean: [4]; cov: [4, 4].
    """
    (rxx, rxy, ryy), (ixx, ixy, iyy) = noise, s_inverse
    if rxx * ryy - rxy * rxy < _PRECISE * det:
        _update_precisely(mean, cov, dx, dy, noise, s_inverse, det)
    else:
        _update_plainly(mean, cov, dx, dy, ixx, ixy, iyy)


@inlined
def _update_plainly(mean, cov, dx, dy, ixx, ixy, iyy):
    p00, p01, p11 = cov[0, 0], cov[0, 1], cov[1, 1]
    p20, p21, p30, p31 = cov[2, 0], cov[2, 1], cov[3, 0], cov[3, 1]
    p22, p32, p33 = cov[2, 2], cov[3, 2], cov[3, 3]
    # rows of K, written out: the filter's hottest lines
    k00, k01 = p00 * ixx + p01 * ixy, p00 * ixy + p01 * iyy
    k10, k11 = p01 * ixx + p11 * ixy, p01 * ixy + p11 * iyy
    k20, k21 = p20 * ixx + p21 * ixy, p20 * ixy + p21 * iyy
    k30, k31 = p30 * ixx + p31 * ixy, p30 * ixy + p31 * iyy
    mean[0] += k00 * dx + k01 * dy
    mean[1] += k10 * dx + k11 * dy
    mean[2] += k20 * dx + k21 * dy
    mean[3] += k30 * dx + k31 * dy
    cov[0, 0] = p00 - (k00 * p00 + k01 * p01)
    cov[1, 1] = p11 - (k10 * p01 + k11 * p11)
    cov[2, 2] = p22 - (k20 * p20 + k21 * p21)
    cov[3, 3] = p33 - (k30 * p30 + k31 * p31)
    cov[0, 1] = cov[1, 0] = p01 - (k00 * p01 + k01 * p11)
    cov[0, 2] = cov[2, 0] = p20 - (k00 * p20 + k01 * p21)
    cov[0, 3] = cov[3, 0] = p30 - (k00 * p30 + k01 * p31)
    cov[1, 2] = cov[2, 1] = p21 - (k10 * p20 + k11 * p21)
    cov[1, 3] = cov[3, 1] = p31 - (k10 * p30 + k11 * p31)
    cov[2, 3] = cov[3, 2] = p32 - (k20 * p30 + k21 * p31)


@kernel
def _update_precisely(mean, cov, dx, dy, noise, s_inverse, det):
    """Where R is small beside P, P - K S Kᵀ would be all rounding. With P in blocks of position and velocity
    [[A, B], [Bᵀ, C]], the same without differences of equals where 2 x 2 matrices allow it:

        A ← R S⁻¹ A = (|A| R + |R| A) / |S|,   B ← R S⁻¹ B,   C ← (1 + δ) C - Bᵀ S⁻¹ B

    with δ above what rounding takes from C, which grows with the correlation ρ of S as 1 / (1 - ρ²).
    """
    (rxx, rxy, ryy), (ixx, ixy, iyy), per_det = noise, s_inverse, 1.0 / det
    p00, p01, p11 = cov[0, 0], cov[0, 1], cov[1, 1]
    p20, p21, p30, p31 = cov[2, 0], cov[2, 1], cov[3, 0], cov[3, 1]
    p22, p32, p33 = cov[2, 2], cov[3, 2], cov[3, 3]
    # rows of K and of R S⁻¹
    g00, g01 = rxx * ixx + rxy * ixy, (rxy * p00 - rxx * p01) * per_det
    g10, g11 = (rxy * p11 - ryy * p01) * per_det, rxy * ixy + ryy * iyy
    k20, k21 = p20 * ixx + p21 * ixy, p20 * ixy + p21 * iyy
    k30, k31 = p30 * ixx + p31 * ixy, p30 * ixy + p31 * iyy
    mean[0] += (p00 * ixx + p01 * ixy) * dx - g01 * dy
    mean[1] += (p01 * ixy + p11 * iyy) * dy - g10 * dx
    mean[2] += k20 * dx + k21 * dy
    mean[3] += k30 * dx + k31 * dy
    of_noise, of_prior = max(0.0, p00 * p11 - p01 * p01) * per_det, (rxx * ryy - rxy * rxy) * per_det
    cov[0, 0] = of_noise * rxx + of_prior * p00
    cov[1, 1] = of_noise * ryy + of_prior * p11
    cov[0, 1] = cov[1, 0] = of_noise * rxy + of_prior * p01
    cov[0, 2] = cov[2, 0] = g00 * p20 + g01 * p21
    cov[0, 3] = cov[3, 0] = g00 * p30 + g01 * p31
    cov[1, 2] = cov[2, 1] = g10 * p20 + g11 * p21
    cov[1, 3] = cov[3, 1] = g10 * p30 + g11 * p31
    more = 1.0 + _ROUNDING * (ixx * iyy * det)  # the bracket is 1 / (1 - ρ²)
    cov[2, 2] = more * p22 - (k20 * p20 + k21 * p21)
    cov[3, 3] = more * p33 - (k30 * p30 + k31 * p31)
    cov[2, 3] = cov[3, 2] = p32 - (k20 * p30 + k21 * p31)


@kernel
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
