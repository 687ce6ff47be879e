"""The track score: its thresholds, its value at birth, and the most that it can gain."""

from __future__ import annotations

import math
from typing import NamedTuple

from trust_env.theory.arguments import require, require_count, require_positive, require_probability


class ScoreThresholds(NamedTuple):
    """Thresholds of the track score L: delete at L < T_1, confirm at L >= T_2 (paper, Eq. 7)."""

    delete: float  # T_1, nats
    confirm: float  # T_2, nats


def score_thresholds(*, alpha: float = 1e-4, beta: float = 1e-2) -> ScoreThresholds:
    """Wald's thresholds `(T_1, T_2)`: T_1 = ln(β / (1 - α)), T_2 = ln((1 - β) / α) (paper, Eq. 7)."""
    require_probability(alpha=alpha, beta=beta)
    return ScoreThresholds(delete=math.log(beta / (1.0 - alpha)), confirm=math.log((1.0 - beta) / alpha))


def initial_score(*, p_detect: float = 0.9, beta_fp: float = 1e-6, beta_nt: float = 1e-9) -> float:
    """Score of a track at birth, L_0 = ln(P_D β_NT / β_FP) in nats (paper, Eq. 5)."""
    require_probability(p_detect=p_detect)
    require_positive(beta_fp=beta_fp, beta_nt=beta_nt)
    return math.log(p_detect * beta_nt / beta_fp)


def score_to_confirm(*, p_detect: float, beta_fp: float, beta_nt: float, alpha: float, beta: float) -> float:
    """T_2 - L_0: what a track must gain after its birth to be confirmed, in nats (paper, Eqs. 5 and 7)."""
    born = initial_score(p_detect=p_detect, beta_fp=beta_fp, beta_nt=beta_nt)
    return score_thresholds(alpha=alpha, beta=beta).confirm - born


def max_hit_gain(*, p_detect: float = 0.9, beta_fp: float = 1e-6, det_r: float = 5.0, eta: int = 2) -> float:
    """The most that one hit can add to a score, in nats (paper, Prop. 1).

    g = ln( P_D / ((2π)^(η/2) β_FP sqrt(det R)) ): ΔL of a hit at d² = 0 with the smallest possible innovation
    covariance, S = R. The filter's own S is larger, so this is a supremum.
    """
    require_probability(p_detect=p_detect)
    require("eta", eta, eta >= 1, "a dimension of at least 1")
    require_positive(beta_fp=beta_fp, det_r=det_r)
    return math.log(p_detect / beta_fp) - 0.5 * eta * math.log(2.0 * math.pi) - 0.5 * math.log(det_r)


def max_score_change(
    n_adversaries: int,
    n_benign: int,
    *,
    p_detect: float = 0.9,
    beta_fp: float = 1e-6,
    det_r: float = 5.0,
    eta: int = 2,
) -> float:
    """The most that one frame can add to the score of a false positive, in nats (paper, Prop. 2).

    ΔL_max = K_a g + K_b ln(1 - P_D), with g = `max_hit_gain`: all adversaries hit, and all benign agents that
    have the false positive in their FOV miss.
    """
    require_count(n_adversaries=n_adversaries, n_benign=n_benign)
    gain = max_hit_gain(p_detect=p_detect, beta_fp=beta_fp, det_r=det_r, eta=eta)
    return n_adversaries * gain + n_benign * math.log1p(-p_detect)
