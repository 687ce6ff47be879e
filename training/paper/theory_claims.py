"""The paper's claims about the track score (Sec. III and the abstract), judged by theory and simulation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from trust_env import theory
from trust_env.training.paper.theorem import N_ADVERSARIES, N_BENIGN, TheoremRow, ceil_frames
from trust_env.training.paper.track_life import (
    CLUTTER,
    GATE_RADIUS,
    clutter_in_a_gate,
    observers_of_tracked_targets,
)
from trust_env.training.paper.verdicts import OURS, Verdict

FIGURE = {(1, 1): 3.07, (1, 3): 6.00}
"""Frames that the paper's figure of Theorem 1 shows, by (K_a, K_b)."""
DRAWN_WITH: dict[str, Any]
CAPTION: dict[str, Any]
DRAWN_WITH, CAPTION = {"eta": 3, "alpha": 1e-4}, {"eta": 3, "alpha": 1e-6}


def theory_verdicts(rows: Sequence[TheoremRow]) -> list[Verdict]:
    """All claims about the track score, and ours about the same."""
    return [
        _prop_2(rows),
        _prop_3(),
        _prop_3_illustration(),
        _figure("the figure's numbers follow from Theorem 1 with α = 1e-4, η = 3", DRAWN_WITH, True),
        _figure("the figure's numbers follow from Theorem 1 with the caption's α = 1e-6", CAPTION, False),
        _six_frames(),
        _single_digit_frames(),
        _printed_bound(rows, alone=True),
        _printed_bound(rows, alone=False),
        _few_adversaries(rows),
        _corrected_bound(rows),
        _optimal(rows),
        _printed_deletion(),
    ]


def _verdict(
    claim: str, holds: bool, numbers: str, expected: bool = True, note: str = "", section: str = "III"
) -> Verdict:
    return Verdict(section, "", claim, "theory", holds, expected, numbers, note)


def _prop_2(rows: Sequence[TheoremRow]) -> Verdict:
    most = max(row.excess for row in rows)
    return _verdict(
        "Props. 1 and 2: no frame adds more than K_a g + K_b ln(1 - P_D) to the score of an FP",
        most <= 1e-9,
        f"the most that any attack added came {-most:.3f} nats short of it",
    )


def _prop_3() -> Verdict:
    """The formula, against scans of the simulated sensors."""
    found = clutter_in_a_gate()
    expected = theory.gate_false_positive_probability(math.pi * GATE_RADIUS**2, CLUTTER)
    share, error = found.hits / found.scans, math.sqrt(expected * (1.0 - expected) / found.scans)
    return _verdict(
        "Prop. 3: clutter falls into a gate of volume V with probability 1 - exp(-β_FP V)",
        abs(share - expected) < 4.0 * error,
        f"{expected:.4f}; {share:.4f} of {found.scans} simulated scans",
    )


def _prop_3_illustration() -> Verdict:
    """A gate of 99 % at 10 Hz, M = 3 dimensions, det R = 5."""
    noise = 5.0 ** (1.0 / 3.0) * np.eye(3)
    volumes = [theory.gate_volume(0.99, times * noise) for times in (2.0, 1.0)]
    seconds = [0.1 / theory.gate_false_positive_probability(volume) for volume in volumes]
    return _verdict(
        "Prop. 3's illustration: clutter falls into a track's gate once in 100 s at 10 Hz",
        abs(seconds[0] - 100.0) < 5.0,
        f"once in {seconds[0]:.0f} s for M = 3 and S = 2R, a young track; in {seconds[1]:.0f} s for S = R",
    )


def _figure(claim: str, drawn: dict[str, Any], expected: bool) -> Verdict:
    found = {cell: theory.frames_to_confirm(*cell, **drawn) for cell in FIGURE}
    numbers = ", ".join(f"f{cell} = {found[cell]:.2f} (figure {FIGURE[cell]:.2f})" for cell in FIGURE)
    holds = all(abs(found[cell] - FIGURE[cell]) < 0.005 for cell in FIGURE)
    note = "" if expected else "the figure was drawn with α = 1e-4; the caption is wrong"
    return _verdict(claim, holds, numbers, expected, note)


def _six_frames() -> Verdict:
    frames = theory.frames_to_confirm(1, 3, **DRAWN_WITH)
    return _verdict(
        "one adversary needs “6 frames” against three honest agents",
        ceil_frames(frames) == 6.0,
        f"T_min = {frames:.4f} at η = 3, so that frame {ceil_frames(frames):.0f} is the first",
        expected=False,
        note="rounded down",
    )


def _single_digit_frames() -> Verdict:
    found = {(a, b): theory.frames_to_confirm(a, b, **DRAWN_WITH) for a in N_ADVERSARIES for b in N_BENIGN}
    slow = {cell: frames for cell, frames in found.items() if ceil_frames(frames) >= 10.0}
    return _verdict(
        "FPs are confirmed in “single-digit frames”",
        not slow,
        "not for " + ", ".join(f"(K_a, K_b) = {cell}: {_frames(frames)}" for cell, frames in slow.items()),
        expected=False,
        note="one adversary fails from four honest agents on, at η = 3",
    )


def _frames(frames: float) -> str:
    return f"{frames:.1f}" if math.isfinite(frames) else "never"


def _printed_bound(rows: Sequence[TheoremRow], alone: bool) -> Verdict:
    """T_min, of one adversary alone, or of several."""
    chosen = [row for row in rows if (row.n_adversaries == 1) == alone]
    early = [row for row in chosen if row.simulated < ceil_frames(row.theorem)]
    worst = max(early, key=lambda row: row.theorem - row.simulated, default=None)
    numbers = f"in all {len(chosen)} cells" if worst is None else (
        f"{len(early)} of {len(chosen)} cells confirm earlier, as K_a = {worst.n_adversaries}, "
        f"K_b = {worst.n_benign}: T_min {worst.theorem:.2f}, frame {worst.simulated:.0f}"
    )  # fmt: skip
    return _verdict(
        f"Thm. 1, {'one adversary' if alone else 'several adversaries'}: no FP is confirmed before frame T_min",
        not early,
        numbers,
        expected=alone,
        note="" if alone else "a centre that takes the agents one after another counts the others' hits at birth",
    )


def _corrected_bound(rows: Sequence[TheoremRow]) -> Verdict:
    early = [row for row in rows if not row.bounded]
    return _verdict(
        "Thm. 1 corrected for several adversaries: no FP is confirmed before frame ⌈T_seq⌉",
        not early,
        f"{len(rows) - len(early)} of {len(rows)} cells, optimal and other attacks",
        section=OURS,
    )


def _optimal(rows: Sequence[TheoremRow]) -> Verdict:
    exact = sum(row.exact for row in rows)
    return _verdict(
        "the optimal attack confirms in exactly the frame that the score recursion gives",
        exact == len(rows),
        f"{exact} of {len(rows)} cells",
        section=OURS,
    )


def _printed_deletion() -> Verdict:
    tracked, untracked = observers_of_tracked_targets("absolute")
    numbers = f"targets with a track have {_counts(tracked)} observers, those without {_counts(untracked)}"
    return _verdict(
        "the printed test for deletion (`absolute`) deletes at birth only what a single agent sees",
        set(untracked) == {1} and 1 not in tracked,
        f"case 1, all honest: {numbers}",
        section=OURS,
    )


def _counts(values: Sequence[int]) -> str:
    return ", ".join(map(str, values)) or "none"


def _few_adversaries(rows: Sequence[TheoremRow]) -> Verdict:
    """The abstract's "significantly vulnerable to even small numbers of adversaries"."""
    alone = max((row.n_benign for row in rows if row.n_adversaries == 1 and math.isfinite(row.simulated)), default=-1)
    two = max((row.simulated for row in rows if row.n_adversaries == 2), default=math.inf)
    most = max(row.n_benign for row in rows)
    return _verdict(
        "the track score is vulnerable to even small numbers of adversaries",
        alone >= 1 and math.isfinite(two),
        f"one adversary prevails over {alone} honest agents, two over {most} within {two:.0f} frames",
        section="abstract",
    )
