"""Track score: the log-likelihood ratio of "a target" against "false alarms" (Sittler 1964; Blackman 1986;
Hallyburton & Pajic 2024, Eqs. 4-7).

    L_0 = ln(P_D β_NT / β_FP)          hit: ΔL = ln(P_D / (2π β_FP sqrt|S|)) - d²/2          miss: ΔL = ln(1 -
    P_D)

The constants of an agent, `hit_constant` = ln(P_D / (2π β_FP)) and `miss_gain`, are packed once per scenario.
"""

from __future__ import annotations

from trust_env.compiled.jit import inlined
from trust_env.world.fields import F, real, whole

TENTATIVE, CONFIRMED = 1, 2  # `status` of a track; 0 is an empty column
BY_SCORE, M_OF_N, SCORE_OR_HITS = 0, 1, 2
DROP, RELATIVE, ABSOLUTE = 0, 1, 2
CONFIRMATIONS = {"score": BY_SCORE, "m_of_n": M_OF_N, "score_or_hits": SCORE_OR_HITS}
DELETIONS = {"drop": DROP, "relative": RELATIVE, "absolute": ABSOLUTE}


@inlined
def hit_gain(hit_constant, log_det, distance2):
    """ΔL of a hit, Eq. 6: `log_det` = ln|S|, `distance2` = d²."""
    return hit_constant - 0.5 * (log_det + distance2)


@inlined
def is_confirmed(world, score, hits, window):
    """Whether a track passes the confirmation test at the end of a frame. `window`: bit b set = hit b frames
    ago.
    """
    rule = whole(world, F.confirmation)
    if rule == M_OF_N:
        count = 0
        for age in range(whole(world, F.confirm_n)):
            count += (window >> age) & 1
        return count >= whole(world, F.confirm_m)
    passed = score >= real(world, F.confirm_threshold)
    if rule == SCORE_OR_HITS:
        return passed or hits >= whole(world, F.confirm_hits)
    return passed


@inlined
def is_lost(world, score, peak, initial, status):
    """Whether a track fails the deletion test at the end of a frame. `peak` is its best end-of-frame score,
    `initial` its L_0.
    """
    rule = whole(world, F.deletion)
    if rule == DROP:
        drop = real(world, F.confirmed_drop) if status == CONFIRMED else real(world, F.tentative_drop)
        return score < peak - drop
    if rule == RELATIVE:
        return score - initial < real(world, F.delete_threshold)
    return score < real(world, F.delete_threshold)
