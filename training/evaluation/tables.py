"""The results of an evaluation as tables in a terminal."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from rich.console import Console
from rich.table import Table
from rich.text import Text

from trust_env.errors import unknown_name
from trust_env.metrics import METRICS
from trust_env.training.console import format_number
from trust_env.training.evaluation.cell import Cell
from trust_env.training.evaluation.results import DAMAGE, REFERENCES, Results
from trust_env.training.evaluation.statistics import Bounds
from trust_env.training.evaluation.summary import Summary

_NAME_WIDTH, _METRIC_WIDTH, _BORDER_WIDTH = 30, 11, 3  # of names at most


def chosen_metrics(text: str) -> list[str]:
    """The metrics named in a text with commas; every metric for "all"."""
    if text == "all":
        return list(METRICS)
    names = text.split(",")
    for name in names:
        if name not in METRICS:
            raise unknown_name("metric", name, METRICS)
    return names


def print_results(results: Results, metrics: Sequence[str], console: Console) -> None:
    """The metrics of every cell in as many tables as the screen's width needs, and what each metric is."""
    for table in result_tables(results, metrics, console.width):
        console.print(table)
    console.print(
        f"{results.scenario}, seed {results.seed}, {results.episodes} episodes a cell: interquartile mean (IQM) "
        "where nothing else is said, 95 % bootstrap interval below; –: undefined"
    )
    for name in metrics:
        unit = "" if METRICS[name].unit == "1" else f" ({METRICS[name].unit})"
        console.print(Text(f"{name}{unit}: {METRICS[name].definition}", style="dim"))
    for note in results.notes:
        console.print(note, markup=False)


class Column(NamedTuple):
    """A column of a table: its heading, and what stands in the row of a cell."""

    heading: str
    entry: Callable[[Cell], Text]


def columns_of(metric: str, results: Results) -> list[Column]:
    """The columns of a metric: one, but for damage, of which the interquartile mean would hide the worst quarter, and
    which is placed between that of two references where they were played.
    """
    middle = Column(metric.replace("_", " "), lambda cell: _entry(cell.summary.get(metric)))
    if metric != DAMAGE:
        return [middle]
    places = {cell.key: results.placed_damage(cell) for cell in results.cells}
    place = [Column("{}: 0, {}: 1".format(*REFERENCES), lambda cell: _place_entry(places[cell.key]))]
    return [
        Column(f"{middle.heading}: mean", lambda cell: _mean_entry(cell.summary.get(metric))),
        Column("worst tenth's mean", lambda cell: _worst_entry(cell.summary.get(metric))),
        middle._replace(heading="IQM"),
        *(place if any(places.values()) else []),
    ]


def result_tables(results: Results, metrics: Sequence[str], width: int) -> Iterator[Table]:
    """Tables with a row for every cell and a column or more for every metric, as many as the width needs."""
    names = [("attack", *(c.attack for c in results.cells)), ("defense", *(c.defense for c in results.cells))]
    widest = min(_NAME_WIDTH, (width - 1 - _METRIC_WIDTH - 3 * _BORDER_WIDTH) // 2)
    widths = [max(1, min(widest, max(map(len, column)))) for column in names]
    room = width - 1 - sum(widths) - 2 * _BORDER_WIDTH
    fitting = max(1, room // (_METRIC_WIDTH + _BORDER_WIDTH))
    columns = [column for metric in metrics for column in columns_of(metric, results)]
    for first in range(0, len(columns), fitting):
        yield _table(results, columns[first : first + fitting], widths)


def _table(results: Results, columns: Sequence[Column], widths: Sequence[int]) -> Table:
    table = Table("attack", "defense", *[column.heading for column in columns])
    for column, widest in zip(table.columns, widths):
        column.width, column.overflow = widest, "fold"
    for column in table.columns[2:]:
        column.justify, column.overflow = "right", "fold"
    above = ""
    for cell in results.cells:
        table.add_section() if above not in ("", cell.attack) else None
        attack = Text(cell.attack if cell.attack != above else "")
        table.add_row(attack, Text(cell.defense), *[column.entry(cell) for column in columns])
        above = cell.attack
    return table


def _entry(summary: Summary | None) -> Text:
    """Interquartile mean and interval, and in how many episodes the metric means "never"."""
    if summary is None:
        return _number(math.nan)
    if summary.never == 1.0:
        return Text("never").append("\n100 %", style="dim")
    text = _number(*summary.interval)
    return text.append(f"\nnever {100 * summary.never:.0f} %", style="dim") if summary.never else text


def _mean_entry(summary: Summary | None) -> Text:
    return _number(math.nan) if summary is None else _number(summary.mean, summary.mean_low, summary.mean_high)


def _worst_entry(summary: Summary | None) -> Text:
    return _number(math.nan if summary is None else summary.worst_decile)


def _place_entry(place: Bounds | None) -> Text:
    return _number(math.nan) if place is None else _number(*place)


def _number(value: float, low: float = math.nan, high: float = math.nan) -> Text:
    """A number with its interval below, if it has one."""
    text = Text("–" if math.isnan(value) else format_number(value))
    dash = "–" if low >= 0.0 else " to "
    return text if math.isnan(low) else text.append(f"\n{format_number(low)}{dash}{format_number(high)}", style="dim")
