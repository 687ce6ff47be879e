"""The episodes that a report plays: the worst, the median and the best of the cells with the highest damage, but for
those of `oracle` and `blank`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from trust_env.training.evaluation.results import DAMAGE
from trust_env.training.replays.episode import Run
from trust_env.training.replays.recording import record
from trust_env.training.reports.evaluation import Evaluation, is_reference

MOST_CELLS = 12


def replays(found: Evaluation, cells: int) -> Iterator[dict[str, Any]]:
    """For so many cells their recordings, each with what it is; or, in place of one, why there is none."""
    run: Run | None = None
    for row, label in _rows(found, cells):
        try:
            run = run or Run(found.path)
            yield {"label": label, "recording": record(run.episode(row)).to_dict()}
        except ValueError as fault:
            yield {"label": label, "fault": str(fault)}
            if run is None:
                return


def _rows(found: Evaluation, cells: int) -> Iterator[tuple[int, str]]:
    """Rows of results.parquet, and what they are called."""
    n = found.results.episodes
    numbered = [(i, c.metrics[DAMAGE]) for i, c in enumerate(found.results.cells) if not is_reference(c.defense)]
    for number, damage in sorted(numbered, key=lambda each: -each[1].mean())[:cells]:
        cell, order = found.results.cells[number], np.argsort(-damage, kind="stable")
        worlds = {"worst": order[0], "median": order[n // 2], "best": order[-1]}
        for name, world in list(worlds.items())[: min(n, 3)]:
            text = f"{name}: world {world}, damage {damage[world]:.3g}"
            yield found.first_row[cell.key] + int(world), f"{cell.attack} x {cell.defense}, {text}"
