"""The results of an evaluation as tables in a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from trust_env.errors import unknown_name
from trust_env.metrics import METRICS
from trust_env.training.console import format_number
from trust_env.training.evaluation.results import Results
from trust_env.training.evaluation.statistics import Interval

DEFAULT_METRICS: tuple[str, ...] = (
    "damage_per_frame",
    "injected_tracks_per_frame",
    "missing_fraction",
    "gospa",
    "frames_to_first_false_track",
    "adversary_auroc",
    "false_accusation_rate",
    "detection_delay",
)
_NAME_WIDTH, _METRIC_WIDTH, _BORDER_WIDTH = 30, 11, 3  # of names at most


def chosen_metrics(text: str | None) -> list[str]:
    """The metrics named in a text with commas; every metric for "all", the default ones for None."""
    if text == "all":
        return list(METRICS)
    names = list(DEFAULT_METRICS) if text is None else text.split(",")
    for name in names:
        if name not in METRICS:
            raise unknown_name("metric", name, METRICS)
    return names


def print_results(results: Results, metrics: Sequence[str], console: Console) -> None:
    """Interquartile means, with the 95 % intervals below, in as many tables as the screen's width needs."""
    for table in result_tables(results, metrics, console.width):
        console.print(table)
    console.print(
        f"{results.scenario}, seed {results.seed}, {results.episodes} episodes a cell: interquartile mean, "
        "95 % bootstrap interval below; –: undefined"
    )
    for note in results.notes:
        console.print(note, markup=False)


def result_tables(results: Results, metrics: Sequence[str], width: int) -> Iterator[Table]:
    """Tables with a row for every cell and a column for every metric, as many as the width needs."""
    names = [("attack", *(c.attack for c in results.cells)), ("defense", *(c.defense for c in results.cells))]
    widest = min(_NAME_WIDTH, (width - 1 - _METRIC_WIDTH - 3 * _BORDER_WIDTH) // 2)
    widths = [max(1, min(widest, max(map(len, column)))) for column in names]
    room = width - 1 - sum(widths) - 2 * _BORDER_WIDTH
    fitting = max(1, room // (_METRIC_WIDTH + _BORDER_WIDTH))
    for first in range(0, len(metrics), fitting):
        shown = metrics[first : first + fitting]
        table = Table("attack", "defense", *[name.replace("_", " ") for name in shown])
        for column, widest in zip(table.columns, widths):
            column.width, column.overflow = widest, "fold"
        for column in table.columns[2:]:
            column.justify, column.overflow = "right", "fold"
        above = ""
        for cell in results.cells:
            table.add_section() if above not in ("", cell.attack) else None
            values = [_entry(cell.summary.get(name)) for name in shown]
            table.add_row(Text(cell.attack if cell.attack != above else ""), Text(cell.defense), *values)
            above = cell.attack
        yield table


def _entry(interval: Interval | None) -> Text:
    if interval is None:
        return Text("–")
    text = Text(format_number(interval.iqm))
    return text.append(f"\n{format_number(interval.low)}–{format_number(interval.high)}", style="dim")
