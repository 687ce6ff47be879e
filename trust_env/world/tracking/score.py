"""Track score: the log-likelihood ratio of "a target" against "false alarms" (Sittler 1964; Blackman 1986;
Hallyburton & Pajic 2024, Eqs. 4-7), and the rules of confirmation and deletion.

    birth:  L_0 = ln(P_D β_NT / β_FP)
    hit:    ΔL  = ln(P_D / (2π β_FP sqrt|S|)) - d²/2
    miss:   ΔL  = ln(1 - P_D)

The constants of an agent, `hit_constant` = ln(P_D / (2π β_FP)) and `miss_gain`, are computed once per scenario.
"""

from __future__ import annotations

from trust_env.compiled.kernels import inlined

TENTATIVE, CONFIRMED = 1, 2  # `status` of a track; 0 is an empty column
BY_SCORE, M_OF_N, SCORE_OR_HITS = range(3)
CONFIRMATIONS = {"score": BY_SCORE, "m_of_n": M_OF_N, "score_or_hits": SCORE_OR_HITS}
DROP, RELATIVE, ABSOLUTE = range(3)
DELETIONS = {"drop": DROP, "relative": RELATIVE, "absolute": ABSOLUTE}


@inlined
def hit_gain(hit_constant, log_det, distance2):
    """ΔL of a hit, Eq. 6: `log_det` = ln|S|, `distance2` = d²."""
    return hit_constant - 0.5 * (log_det + distance2)


@inlined
def is_confirmed(world, score, hits, window):
    """Whether a track passes the confirmation test at the end of a frame.

    window: bit b set = hit b frames ago.
    """
    rules = world.parameters
    if rules.confirmation == M_OF_N:
        count = 0
        for age in range(rules.confirm_n):
            count += (window >> age) & 1
        return count >= rules.confirm_m
    passed = score >= rules.confirm_threshold
    if rules.confirmation == SCORE_OR_HITS:
        return passed or hits >= rules.confirm_hits
    return passed


@inlined
def is_lost(world, score, peak, initial, status):
    """Whether a track fails the deletion test at the end of a frame.

    peak: its best score at the end of a frame; initial: its L_0.
    """
    rules = world.parameters
    if rules.deletion == DROP:
        drop = rules.confirmed_drop if status == CONFIRMED else rules.tentative_drop
        return score < peak - drop
    if rules.deletion == RELATIVE:
        return score - initial < rules.delete_threshold
    return score < rules.delete_threshold
