"""In how many frames a false positive can be confirmed at the earliest: Theorem 1, and its corrected bound."""

from __future__ import annotations

import math

from trust_env.theory.score import max_hit_gain, max_score_change, score_to_confirm


def frames_to_confirm(
    n_adversaries: int,
    n_benign: int,
    *,
    p_detect: float = 0.9,
    beta_fp: float = 1e-6,
    beta_nt: float = 1e-9,
    det_r: float = 5.0,
    eta: int = 2,
    alpha: float = 1e-4,
    beta: float = 1e-2,
) -> float:
    """Fewest frames in which a false positive can be confirmed (paper, Thm. 1); a real number, or infinity.

    T_min = 1 + (T_2 - L_0) / (K_a g + K_b ln(1 - P_D)): the first frame contributes L_0 alone, every later
    one `max_score_change`. Infinity where that change is not positive. The paper's figure was drawn with
    α = 1e-4 and η = 3 (its caption says 1e-6).
    """
    hit = {"p_detect": p_detect, "beta_fp": beta_fp}
    change = max_score_change(n_adversaries, n_benign, **hit, det_r=det_r, eta=eta)
    needed = score_to_confirm(**hit, beta_nt=beta_nt, alpha=alpha, beta=beta)
    return _frames(needed, change)


def sequential_frames_to_confirm(
    n_adversaries: int,
    n_benign: int,
    *,
    p_detect: float = 0.9,
    beta_fp: float = 1e-6,
    beta_nt: float = 1e-9,
    det_r: float = 5.0,
    eta: int = 2,
    alpha: float = 1e-4,
    beta: float = 1e-2,
) -> float:
    """Theorem 1 for a centre that updates agent by agent: a lower bound that no attack beats.

    T_seq = 1 + max(0, T_2 - L_0 - (K_a - 1) g) / (K_a g + K_b ln(1 - P_D)), which is T_min for K_a = 1: the
    other K_a - 1 adversaries hit the newborn track in its first frame already. No false positive is confirmed
    before frame ceil(T_seq), frames counted from 1, while its track lies inside every benign FOV. Infinity
    where the first frame does not suffice and no later one can add to the score.
    """
    hit = {"p_detect": p_detect, "beta_fp": beta_fp}
    change = max_score_change(n_adversaries, n_benign, **hit, det_r=det_r, eta=eta)
    needed = score_to_confirm(**hit, beta_nt=beta_nt, alpha=alpha, beta=beta)
    needed -= (n_adversaries - 1) * max_hit_gain(**hit, det_r=det_r, eta=eta)
    confirmed_at_birth = n_adversaries > 0 and needed <= 0.0
    return 1.0 if confirmed_at_birth else _frames(needed, change)


def _frames(needed: float, change: float) -> float:
    """The first frame, and those in which a score that changes by `change` per frame gains `needed`, nats."""
    return 1.0 + max(0.0, needed) / change if change > 0.0 else math.inf
