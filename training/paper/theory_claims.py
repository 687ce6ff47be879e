"""The paper's claims about the track score (Sec. III), judged by theory and simulation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from trust_env import theory
from trust_env.training.paper.theorem import TheoremRow, ceil_frames
from trust_env.training.paper.verdicts import Verdict

FIGURE = {(1, 1): 3.07, (1, 3): 6.00}
"""Frames that the paper's figure of Theorem 1 shows, by (K_a, K_b)."""
DRAWN_WITH: dict[str, Any]
CAPTION: dict[str, Any]
DRAWN_WITH, CAPTION = {"eta": 3, "alpha": 1e-4}, {"eta": 3, "alpha": 1e-6}


def theory_verdicts(rows: Sequence[TheoremRow]) -> list[Verdict]:
    """All claims of Sec. III."""
    return [
        _prop_2(rows),
        _prop_3(),
        _figure("the figure's numbers follow from Theorem 1 with α = 1e-4, η = 3", DRAWN_WITH, True),
        _figure("the figure's numbers follow from Theorem 1 with the caption's α = 1e-6", CAPTION, False),
        _printed_bound(rows),
        _exact_bound(rows),
        _optimal(rows),
        _few_adversaries(rows),
    ]


def _verdict(claim: str, holds: bool, numbers: str, expected: bool = True, note: str = "") -> Verdict:
    return Verdict("III", claim, "theory", holds, expected, numbers, note)


def _prop_2(rows: Sequence[TheoremRow]) -> Verdict:
    most = max(row.excess for row in rows)
    return _verdict(
        "Props. 1 and 2: no frame adds more than K_a g + K_b ln(1 - P_D) to the score of an FP",
        most <= 1e-9,
        f"the most that any attack added came {-most:.3f} nats short of it",
    )


def _prop_3() -> Verdict:
    """Natural false positives in a gate of 99 %, at 10 Hz."""
    volumes = [theory.gate_volume(0.99, 5.0 ** (1.0 / eta) * np.eye(eta)) for eta in (2, 3)]
    seconds = [0.1 / theory.gate_false_positive_probability(volume) for volume in volumes]
    return _verdict(
        "Prop. 3: clutter falls into a track's gate about once in 100 s at 10 Hz",
        any(50.0 < s < 200.0 for s in seconds),
        f"once in {seconds[0]:.0f} s for η = 2, {seconds[1]:.0f} s for η = 3 (det R = 5)",
        expected=False,
        note="it takes a gate of 1000 units of volume, which the paper's other numbers do not give",
    )


def _figure(claim: str, drawn: dict[str, Any], expected: bool) -> Verdict:
    found = {cell: theory.frames_to_confirm(*cell, **drawn) for cell in FIGURE}
    numbers = ", ".join(f"f{cell} = {found[cell]:.2f} (figure {FIGURE[cell]:.2f})" for cell in FIGURE)
    holds = all(abs(found[cell] - FIGURE[cell]) < 0.005 for cell in FIGURE)
    note = "" if expected else "the figure was drawn with α = 1e-4; the caption is wrong"
    return _verdict(claim, holds, numbers, expected, note)


def _printed_bound(rows: Sequence[TheoremRow]) -> Verdict:
    early = [row for row in rows if row.simulated < ceil_frames(row.theorem)]
    worst = max(early, key=lambda row: row.theorem - row.simulated, default=None)
    numbers = "in all cases" if worst is None else (
        f"{len(early)} of {len(rows)} cells confirm earlier, as K_a = {worst.n_adversaries}, "
        f"K_b = {worst.n_benign}: T_min {worst.theorem:.2f}, frame {worst.simulated:.0f}"
    )  # fmt: skip
    return _verdict(
        "Thm. 1: no FP is confirmed before frame T_min",
        not early,
        numbers,
        expected=False,
        note="true for one adversary; a centre that takes the agents one after another counts hits at birth",
    )


def _exact_bound(rows: Sequence[TheoremRow]) -> Verdict:
    early = [row for row in rows if not row.bounded]
    numbers = f"{len(rows) - len(early)} of {len(rows)} cells, optimal and other attacks"
    return _verdict("Thm. 1, exact form: no FP is confirmed before frame ⌈T_seq⌉", not early, numbers)


def _optimal(rows: Sequence[TheoremRow]) -> Verdict:
    exact = sum(row.exact for row in rows)
    return _verdict(
        "the optimal attack confirms in exactly the frame that the score recursion gives",
        exact == len(rows),
        f"{exact} of {len(rows)} cells",
    )


def _few_adversaries(rows: Sequence[TheoremRow]) -> Verdict:
    """The abstract's "significantly vulnerable to even small numbers of adversaries"."""
    alone = max((row.n_benign for row in rows if row.n_adversaries == 1 and math.isfinite(row.simulated)), default=-1)
    two = max((row.simulated for row in rows if row.n_adversaries == 2), default=math.inf)
    most = max(row.n_benign for row in rows)
    return _verdict(
        "the track score is vulnerable to even small numbers of adversaries",
        alone >= 1 and math.isfinite(two),
        f"one adversary prevails over {alone} honest agents, two over {most} within {two:.0f} frames",
    )
