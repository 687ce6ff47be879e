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

Tell = Callable[[str], None]


@contextmanager
def progress(
    title: str, total: int, shown: bool = True, done: int = 0
) -> Iterator[tuple[Callable[[int], None], Tell]]:
    """A bar while the block runs: `advance(n)` of `total` steps, of which some are `done`, and `tell(text)`
    what is being done.
    """
    what = TextColumn("{task.description}", markup=False)
    columns = (what, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(
        *columns, console=console, transient=True, disable=not (shown and console.is_terminal)
    ) as bar:
        task = bar.add_task(title, total=total, completed=done)
        yield (lambda n: bar.advance(task, n)), (lambda text: bar.update(task, description=text))


def number(value: float) -> str:
    """Three or four digits."""
    size = abs(value)
    return f"{value:.{0 if size >= 100 else 1 if size >= 10 else 2 if size >= 1 else 3}f}"
