"""What commands show while they run, on stderr, and how they print numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

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


def format_number(value: float) -> str:
    """A number with three or four significant digits."""
    size = abs(value)
    return f"{value:.{0 if size >= 100 else 1 if size >= 10 else 2 if size >= 1 else 3}f}"
