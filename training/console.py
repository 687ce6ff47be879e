"""What commands show while they run, on stderr, and how they print tables and numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.measure import Measurement
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Column, Table
from rich.text import Text

_NARROWEST, _BORDER = 12, 3  # of a column whose words may be broken; of every column

Advance = Callable[[int], None]
Describe = Callable[[str], None]


@contextmanager
def progress_bar(title: str, total: int, shown: bool = True, done: int = 0) -> Iterator[tuple[Advance, Describe]]:
    """A progress bar while the block runs, of `total` steps, of which some are `done`.

    Yields `advance(n)`, to call after n more steps, and `describe(text)`, which replaces the title.
    """
    title_column = TextColumn("{task.description}", markup=False)
    columns = (title_column, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    hidden = not (shown and console.is_terminal)
    with Progress(*columns, console=console, transient=True, disable=hidden) as bar:
        task = bar.add_task(title, total=total, completed=done)
        yield (lambda n: bar.advance(task, n)), (lambda text: bar.update(task, description=text))


def print_table(console: Console, table: Table) -> None:
    """Print a table, where its words do not fit side by side as a line for every entry; nothing is cut off."""
    if 1 + sum(_narrowest(console, column) + _BORDER for column in table.columns) <= console.width:
        for column in table.columns:
            column.overflow = "fold"
        console.print(table)
        return
    if table.title:
        console.print(table.title)
    for cells in zip(*(column.cells for column in table.columns)):
        for column, cell in zip(table.columns, cells):
            header, text = _line(column.header), _line(cell)
            if text:
                console.print(Text(f"{header}: {text}" if header else text))
        console.print()
    if table.caption:
        console.print(table.caption)


def _line(cell: Any) -> str:
    """The text of a cell without its line breaks and its markup."""
    return (cell if isinstance(cell, Text) else Text.from_markup(str(cell))).plain.replace("\n", " ")


def _narrowest(console: Console, column: Column) -> int:
    """The width at which no word of a column is broken, but of one that folds."""
    wide = console.options.update(width=1000)
    width = max(Measurement.get(console, wide, cell).minimum for cell in (column.header, *column.cells))
    return min(width, _NARROWEST) if column.overflow == "fold" else width


def format_number(value: float) -> str:
    """A number with three or four significant digits."""
    size = abs(value)
    return f"{value:.{0 if size >= 100 else 1 if size >= 10 else 2 if size >= 1 else 3}f}"
