"""The results of an evaluation in one table that fits a screen of 80 columns, and what its columns mean."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from trust_env.training.console import format_number
from trust_env.training.evaluation.cell import Cell
from trust_env.training.evaluation.configuration import is_code
from trust_env.training.evaluation.replay_code import worst_world
from trust_env.training.evaluation.results import DAMAGE, Results
from trust_env.training.evaluation.summary import Summary

_GAP, _WIDE = 2, 100  # between columns, on screens that are so wide; else 1


class Heading(NamedTuple):
    """A column of the overview: its heading, its width and what it means."""

    heading: str
    width: int
    meaning: str


# Metrics are means over the episodes; `worst` is of damage.
COLUMNS: dict[str, Heading] = {
    DAMAGE: Heading("damage", 9, "false tracks shown plus targets missing, per frame"),
    "worst": Heading("worst", 5, "damage in the worst tenth of the episodes"),
    "injected_tracks_per_frame": Heading("injected", 8, "of the false tracks those that injections made, per frame"),
    "missing_targets_per_frame": Heading("missing", 7, "targets in somebody's view that no track shows, per frame"),
    "adversary_auroc": Heading("AUROC", 5, "1: low trust tells adversaries apart, 0.5: as by chance"),
    "false_accusation_rate": Heading("falsely accused", 7, "share of the benign agents that are accused"),
}
_ABSENT = "nobody attacks, or the defense has no opinion"


def print_overview(results: Results, console: Console, out: Path | None = None) -> None:
    """The table, a line for each column, the notes, and how to see the worst episode again.

    out: the folder that the results are in, None: they are in none.
    """
    console.print(overview_table(results, console.width))
    episodes = f"{results.episodes} episode{'s' if results.episodes > 1 else ''}"
    console.print(f"{results.scenario}, seed {results.seed}: means over {episodes} a cell, 95 % intervals below")
    width = max(len(column.heading) for column in COLUMNS.values())
    for column in COLUMNS.values():
        _say(console, f"  {column.heading:{width}}  {column.meaning}")
    _say(console, f"  {'–':{width}}  {_ABSENT}")
    for note in results.notes:
        _say(console, note)
    if results.cells:
        _print_replay(results, console, out)
        if out is not None:
            _say(console, "all of it as a page, with pictures and replays:")
            _print_code(console, shlex.join(["trust-env", "report", str(out), *_code(results.cells)]))
    _say(console, "more: --metric all, or the metrics of `trust-env metrics list` by name")
    if out is None:
        _say(console, "pictures: --out RUN keeps the results, and `trust-env report RUN` makes a page of them")


def _print_replay(results: Results, console: Console, out: Path | None) -> None:
    """How to see the worst episode of all cells again: a command, or Python where the scenario is an object."""
    at, cell = max(enumerate(results.cells), key=lambda entry: entry[1].metrics[DAMAGE].max())
    world = worst_world(cell, DAMAGE)
    episode = (cell.attack, cell.defense, results.seed, world)
    if out is not None:
        row = str(at * results.episodes + world)
        text = shlex.join(["trust-env", "replay", str(out), "--row", row, *_code([cell])])
    elif results.setting.source is not None:
        text = results.setting.replay_command(*episode)
    else:
        text = results.setting.replay_code(*episode)
    _say(console, "the worst episode, to look at:")
    _print_code(console, text)


def _code(cells: Iterable[Cell]) -> Iterator[str]:
    """The options that say which of the user's own code is to be played, as no name in a folder makes it run."""
    for kind in ("attack", "defense"):
        names = [name for name in dict.fromkeys(getattr(cell, kind) for cell in cells) if is_code(kind, name)]
        yield from [f"--{kind}", ",".join(names)] if names else []


def _print_code(console: Console, text: str) -> None:
    for line in text.splitlines():
        console.print(Text(f"  {line}", style="dim"), soft_wrap=True)


def _say(console: Console, text: str) -> None:
    console.print(Text(text, style="dim"))


def overview_table(results: Results, width: int) -> Table:
    """A row for every cell; names that are too long for a screen are broken, at their parts if that will do."""
    gap = _GAP if width >= _WIDE else 1
    room = width - gap - sum(column.width + gap for column in COLUMNS.values())
    whole = [max(map(len, names)) for names in _names(results)]
    broken = sum(whole) > room
    parts = [max(len(line) for name in names for line in _broken(name).split("\n")) for names in _names(results)]
    widths = whole if not broken else parts if sum(parts) <= room else (room // 2, room - room // 2)
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, gap - 1, 0, 0), show_edge=False)
    for name, widest in zip(("attack", "defense"), widths):
        table.add_column(name, width=widest, overflow="fold")
    for column in COLUMNS.values():
        table.add_column(column.heading, width=column.width, justify="right")
    above = ""
    for cell in results.cells:
        table.add_section() if above not in ("", cell.attack) else None
        names = ("" if cell.attack == above else cell.attack, cell.defense)
        shown = [Text(_broken(name) if broken and len(name) > widest else name) for name, widest in zip(names, widths)]
        table.add_row(*shown, *[_entry(cell, name) for name in COLUMNS])
        above = cell.attack
    return table


def _broken(name: str) -> str:
    """A name with its class and its parameters on lines of their own."""
    before, bracket, after = name.partition("(")
    return before.replace(".py:", ".py:\n") + (f"\n{bracket}{after}" if bracket else "")


def _names(results: Results) -> Iterator[list[str]]:
    yield ["attack", *(cell.attack for cell in results.cells)]
    yield ["defense", *(cell.defense for cell in results.cells)]


def _entry(cell: Cell, column: str) -> Text:
    summary = cell.summary.get(DAMAGE if column == "worst" else column)
    if summary is None or math.isnan(summary.mean):
        return Text("–")
    if column == "worst":
        return Text(format_number(summary.worst_decile))
    text = Text(format_number(summary.mean))
    return text.append(f"\n{_interval(summary)}", style="dim") if column == DAMAGE else text


def _interval(summary: Summary) -> str:
    """The interval of the mean, in at most nine signs where it lies below 100."""
    low, high = (f"{value:.1f}" if value >= 10 else f"{value:.2f}" for value in (summary.mean_low, summary.mean_high))
    return f"{low}–{high}"
