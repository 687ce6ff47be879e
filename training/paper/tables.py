"""What `reproduce` found, as rows of text, and these as tables in a terminal or in Markdown."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from rich.table import Table
from rich.text import Text

from trust_env.training.paper.choices import CHOICES
from trust_env.training.paper.published import N_AGENTS, Panel, PanelKey, objects
from trust_env.training.paper.theorem import N_BENIGN, TheoremRow
from trust_env.training.paper.trust_claims import EXPLAINING, claims_of
from trust_env.training.paper.verdicts import Verdict

Panels = Mapping[str, Mapping[PanelKey, Panel]]  # by source
Rows = list[list[str]]
SHOWN = ("published", "cdc2024", "paper", "mate")
HOLDS, FAILS, YES, NO, _UNEXPECTED = "holds", "does not hold", "yes", "no", " (unexpected)"
_STYLES = {HOLDS: "green", YES: "green", FAILS: "yellow", NO: "yellow"}
CHOICES_HEADER = ("choice", "the text", "`paper`", "`cdc2024`", "set by")
THEORY_HEADER = ("section", "claim", "verdict", "numbers")
CLAIMS_HEADER = ("section", "case", "does it hold that", *SHOWN)
FAILURES_HEADER = ("case", "claim", "for", "verdict", "numbers")


def theorem_table(rows: Sequence[TheoremRow]) -> Table:
    """A line per team; `rows` come in pairs, adversaries first and last."""
    caption = (
        "adversaries first / last among the agents. T_min: Theorem 1; ⌈T_seq⌉: corrected for several adversaries; "
        "recursion: of the score, with the filter's own S; simulated: optimal_false_positive; others: the "
        "earliest of four other attacks"
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


def panel_table(title: str, panels: Panels) -> Table:
    """The final trust of every curve of all panels; the sources are the columns, `paper*` left out."""
    sources = [source for source in panels if source != EXPLAINING]
    caption = "published: the authors' own code; else the presets of `trust` in our environment, with its own tracker"
    table = Table(title=title, caption=caption)
    table.add_column("case")
    table.add_column("trust in")
    for name in sources:
        table.add_column(name, justify="right")
    for key in panels[sources[0]]:
        rows = zip(curve_names(key[0]), *(panels[source][key].final_trust for source in sources), strict=True)
        label = panel_name(key)
        for name, *values in rows:
            table.add_row(label, name, *(f"{value:.3f}" for value in values))
            label = ""
        table.add_section()
    return table


def panel_name(key: PanelKey) -> str:
    return f"{key[0]}, {'prior on agent 1' if key[1] else 'no prior'}"


def curve_names(case: str) -> list[str]:
    """Of the tracks and then the agents of a case."""
    return [obj.name for obj in objects(case)] + [f"agent {k}" for k in range(N_AGENTS)]


def agent_rows(panels: Panels, sources: Sequence[str]) -> Rows:
    """The final trust in every agent, by panel; the numbers of all sources in one cell."""
    rows = []
    for key in panels[sources[0]]:
        by_agent = zip(*(panels[source][key].agents[:, -1] for source in sources), strict=True)
        rows.append([panel_name(key), *(" / ".join(f"{trust:.3f}" for trust in agent) for agent in by_agent)])
    return rows


def suppression_table(panels: Panels, sources: Sequence[str]) -> tuple[list[str], Rows]:
    """Header and rows: the final trust in what adversaries keep silent about, and in every agent, by panel."""
    header = ["", *(f"hidden target {n}" for n in range(1, 3)), *(f"agent {k}" for k in range(N_AGENTS))]
    rows = []
    for key in panels[sources[0]]:
        hidden = [j for j, obj in enumerate(objects(key[0])) if obj.kind == "hidden"]
        finals = (panels[source][key].final_trust[[*hidden, -3, -2, -1]] for source in sources)
        cells = [" / ".join(f"{trust:.2f}" for trust in values) for values in zip(*finals, strict=True)]
        rows.append([panel_name(key), *cells])
    return header, rows


def claim_rows(verdicts: Sequence[Verdict]) -> Rows:
    """A row per claim about trust, by source whether it holds, and in the last row how many do."""
    found: dict[tuple[str, str, str], dict[str, str]] = {}
    for v in verdicts:
        if v.case:
            found.setdefault((v.section, v.case, v.claim), {})[v.source] = _verdict(v, YES, NO)
    counts = [claims_of(source, verdicts) for source in SHOWN]
    totals = ["", "", "claims that hold", *(f"{holding} of {all_}" for holding, all_ in counts)]
    return [[*claim, *(by_source[source] for source in SHOWN)] for claim, by_source in found.items()] + [totals]


def theory_rows(verdicts: Sequence[Verdict]) -> Rows:
    """A row per claim about the track score."""
    chosen = [v for v in verdicts if not v.case]
    return [[v.section, v.claim, _verdict(v), _numbers(v)] for v in chosen]


def failure_rows(verdicts: Sequence[Verdict]) -> Rows:
    """Claims about trust that a source does not bear out: numbers, and why; and what `paper*` makes of them."""
    chosen = [v for v in verdicts if v.case and (not v.holds or v.source == EXPLAINING)]
    chosen.sort(key=lambda v: (v.case, v.claim))
    return [[v.case, v.claim, v.source, _verdict(v), _numbers(v)] for v in chosen]


def choice_rows() -> Rows:
    return [list(choice) for choice in CHOICES]


def _verdict(verdict: Verdict, holds: str = HOLDS, fails: str = FAILS) -> str:
    return (holds if verdict.holds else fails) + ("" if verdict.as_expected else _UNEXPECTED)


def _numbers(verdict: Verdict) -> str:
    return f"{verdict.numbers} ({verdict.note})" if verdict.note else verdict.numbers


def text_table(title: str, header: Sequence[str], rows: Rows) -> Table:
    """Rows as a table in a terminal, verdicts in colour."""
    table = Table(*(name.replace("`", "") for name in header), title=title, show_lines=True)
    for row in rows:
        table.add_row(*(_cell(text.replace("`", "")) for text in row))
    return table


def _cell(text: str) -> Text:
    style = "bold red" if text.endswith(_UNEXPECTED) else _STYLES.get(text, "")
    return Text(text, style=style)


def markdown(header: Sequence[str], rows: Rows) -> str:
    """Rows as a table in Markdown; what does not hold in bold."""
    lines = [list(header), ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(f"**{c}**" if c in (FAILS, NO) else c for c in line) + " |" for line in lines)


def _mark(good: bool, yes: str, no: str) -> Text:
    return Text(yes if good else no, style="green" if good else "bold red")


def _frames(value: float, digits: int = 0) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "never"
