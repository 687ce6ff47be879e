"""How likely a natural false positive falls into the gate of a track."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from trust_env.theory.arguments import as_covariance, require


def gate_volume(gate: float, innovation_cov: ArrayLike) -> float:
    """Volume of the gate, the ellipsoid d² <= G, in units of the measurement space (paper, Prop. 3).

    V_G = π^(η/2) / Γ(η/2 + 1) · G^(η/2) · sqrt(det S), which is π G sqrt(det S) for η = 2.

    gate            below 1: the probability that a target's own detection falls inside, from which G follows
                    as the chi-square quantile (like the tracker's `gate`); from 1 on: the threshold G itself
    innovation_cov  S[η, η]
    """
    cov = as_covariance("innovation_cov", innovation_cov)
    require("gate", gate, 0.0 < gate < math.inf, "a probability in (0, 1), or a threshold on d²")
    eta = cov.shape[0]
    threshold = gate if gate >= 1.0 else _chi_square_quantile(gate, eta)
    unit_ball = math.pi ** (0.5 * eta) / math.gamma(0.5 * eta + 1.0)
    return unit_ball * threshold ** (0.5 * eta) * math.sqrt(np.linalg.det(cov))


def gate_false_positive_probability(gate_volume: float, beta_fp: float = 1e-6) -> float:
    """Probability of at least one natural false positive of one agent in a gate in a frame (paper, Prop. 3).

    P = 1 - exp(-β_FP V_G), as clutter is Poisson with density β_FP.
    """
    require("gate_volume", gate_volume, 0.0 <= gate_volume < math.inf, "a volume of at least 0")
    require("beta_fp", beta_fp, 0.0 <= beta_fp < math.inf, "a density of at least 0")
    return -math.expm1(-beta_fp * gate_volume)


def _chi_square_quantile(probability: float, eta: int) -> float:
    """G with P[χ²_η <= G] = probability; in closed form, -2 ln(1 - probability), for planar measurements."""
    if eta == 2:
        return -2.0 * math.log1p(-probability)
    from scipy.special import gammaincinv  # only other dimensions need SciPy

    return 2.0 * float(gammaincinv(0.5 * eta, probability))
