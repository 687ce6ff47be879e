"""What `reproduce` found, as tables in a terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from rich.table import Table
from rich.text import Text

from trust_env.training.paper.published import N_AGENTS, Panel, PanelKey, objects, panel_keys
from trust_env.training.paper.theorem import N_BENIGN, TheoremRow
from trust_env.training.paper.verdicts import Verdict

SHOWN = ("published", "cdc2024", "paper")


def theorem_table(rows: Sequence[TheoremRow]) -> Table:
    """A line per team; `rows` come in pairs, adversaries first and last."""
    caption = (
        "adversaries first / last among the agents. T_min: Theorem 1; ⌈T_seq⌉: its exact bound; recursion: "
        "of the score, with the filter's own S; simulated: optimal_false_positive; others: the earliest of "
        "four other attacks"
    )
    table = Table(title="Theorem 1: frames until a false positive is confirmed", caption=caption)
    for name in ("K_a", "K_b", "T_min", "⌈T_seq⌉", "recursion", "simulated", "others"):
        table.add_column(name, justify="right")
    table.add_column("verdict")
    for first, last in zip(rows[::2], rows[1::2], strict=True):
        names = "recursion", "simulated", "earliest_other"
        table.add_row(
            str(first.n_adversaries), str(first.n_benign), _frames(first.theorem, 2), _frames(first.bound),
            *(f"{_frames(getattr(first, name))} / {_frames(getattr(last, name))}" for name in names),
            _mark(first.ok and last.ok, "agree", "DISAGREE"), end_section=first.n_benign == N_BENIGN[-1],
        )  # fmt: skip
    return table


def panel_table(panels: Mapping[str, Mapping[PanelKey, Panel]]) -> Table:
    """The final trust of every curve of the eight panels."""
    caption = "published: the authors' own code; cdc2024, paper: our whole environment, with its own tracker"
    table = Table(title="Trust after 20 frames", caption=caption)
    table.add_column("case")
    table.add_column("trust in")
    for name in SHOWN:
        table.add_column(name, justify="right")
    for key in panel_keys():
        rows = zip(curve_names(key[0]), *(panels[source][key].final_trust for source in SHOWN), strict=True)
        label = f"{key[0]}, {'prior on 1' if key[1] else 'no prior'}"
        for name, *values in rows:
            table.add_row(label, name, *(f"{value:.3f}" for value in values))
            label = ""
        table.add_section()
    return table


def curve_names(case: str) -> list[str]:
    """Of the tracks and then the agents of a case."""
    return [obj.name for obj in objects(case)] + [f"agent {k}" for k in range(N_AGENTS)]


def verdict_table(verdicts: Sequence[Verdict]) -> Table:
    """Claim by claim; the sources of a claim stand below each other."""
    table = Table(title="What the paper claims, and what holds")
    for name in ("Sec.", "claim", "for", "verdict", "numbers"):
        table.add_column(name)
    above = ("", "")
    for verdict in verdicts:
        key = (verdict.section, verdict.claim)
        if key != above:
            table.add_section()
        section, claim = key if key != above else ("", "")
        mark = _mark(verdict.holds, "holds", "does not hold", unexpected=not verdict.as_expected)
        numbers = Text(verdict.numbers)
        if verdict.note:
            numbers.append(f" ({verdict.note})", style="dim")
        table.add_row(section, Text(claim), verdict.source, mark, numbers)
        above = key
    return table


def _mark(good: bool, yes: str, no: str, unexpected: bool = False) -> Text:
    text = (yes if good else no) + (" (unexpected)" if unexpected else "")
    return Text(text, style="bold red" if unexpected else "green" if good else "yellow")


def _frames(value: float, digits: int = 0) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "never"
