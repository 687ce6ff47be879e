"""A curve as a table in a terminal."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from trust_env.metrics import METRICS
from trust_env.training.console import format_number, print_table
from trust_env.training.curves.points import Curve


def curve_table(found: Curve) -> Table:
    """A row for every attack and defense, a column for every value: mean, and its 95 % bootstrap interval below."""
    unit = METRICS[found.metric].unit
    results = found.points[0][1]
    caption = (
        f"{results.scenario}, seed {results.seed}, {results.episodes} episodes a cell: mean, 95 % bootstrap interval "
        f"below. {found.over}: {found.meaning}"
    )
    title = f"{found.metric}{'' if unit == '1' else f' ({unit})'} over {found.over}"
    table = Table("attack", "defense", *map(_heading, found.values), title=title, caption=caption)
    for column in table.columns[2:]:
        column.justify = "right"
    above = ""
    for attack, defense in found.lines:
        table.add_section() if above not in ("", attack) else None
        cells = [_entry(found, attack, defense, value) for value in found.values]
        table.add_row(Text(attack if attack != above else ""), Text(defense), *cells)
        above = attack
    return table


def print_curve(found: Curve, console: Console) -> None:
    """The table, and what is to be known beside it."""
    print_table(console, curve_table(found))
    for note in dict.fromkeys(note for _, results in found.points for note in results.notes):
        console.print(note, markup=False)


def _heading(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _entry(found: Curve, attack: str, defense: str, value: Any) -> Text:
    summary = found.summary(attack, defense, value)
    if summary is None:
        return Text("–")
    if summary.never == 1.0:
        return Text("never")
    text = Text(format_number(summary.mean))
    return text.append(f"\n{format_number(summary.mean_low)}–{format_number(summary.mean_high)}", style="dim")
