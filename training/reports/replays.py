"""The episodes that a report plays: the worst, the median and the best of the cells with the highest damage, but for
those of `oracle` and `blank`; each beside another defense on the same episode, where the run has one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from trust_env.training.evaluation.cell import Cell
from trust_env.training.evaluation.results import DAMAGE
from trust_env.training.replays.episode import Run
from trust_env.training.replays.recording import record
from trust_env.training.reports.evaluation import Evaluation, is_reference

MOST_CELLS = 12


class Played(NamedTuple):
    """An episode of a cell: its own recording and that beside it, or why they are not there."""

    cell: str
    label: str
    recordings: list[dict[str, Any]]
    fault: str = ""


def replays(found: Evaluation, cells: int, against: str | None, code: Mapping[str, Any]) -> Iterator[Played]:
    """The episodes of so many cells.

    against: the defense that stands beside the others, itself beside the one of least damage; None: none does. code: by
    name the attacks and defenses that are the user's own code, or objects, and may be played.
    """
    run: Run | None = None
    for cell, world, label in _episodes(found, cells):
        played = Played(_name(cell), f"{_name(cell)}, {label}", [])
        try:
            run = run or Run(found.path)
            played.recordings.append(_recorded(run, found, cell, world, code))
        except ValueError as fault:
            yield played._replace(fault=str(fault))
            if run is None:
                return
            continue
        try:
            beside = () if against is None else _beside(found, cell, against)
            played.recordings.extend(_recorded(run, found, each, world, code) for each in beside)
            yield played
        except ValueError as fault:
            yield played._replace(cell=f"beside {_name(cell)}", fault=str(fault))


def _name(cell: Cell) -> str:
    return f"{cell.attack} x {cell.defense}"


def _recorded(run: Run, found: Evaluation, cell: Cell, world: int, code: Mapping[str, Any]) -> dict[str, Any]:
    row = found.first_row[cell.key] + world
    return record(run.episode(row, code.get(cell.attack), code.get(cell.defense))).to_dict()


def _beside(found: Evaluation, cell: Cell, against: str) -> list[Cell]:
    """The cell to see on the same episodes: that of `against`, or, beside this, that of least damage."""
    others = [each for each in found.results.cells if each.attack == cell.attack and each.defense != cell.defense]
    known = [each for each in others if each.defense == against]
    judged = sorted((each for each in others if not is_reference(each.defense)), key=_damage)
    return (known or judged)[:1]


def _damage(cell: Cell) -> float:
    return float(cell.metrics[DAMAGE].mean())


def _episodes(found: Evaluation, cells: int) -> Iterator[tuple[Cell, int, str]]:
    """Cells, worlds, and what the episodes are called."""
    judged = [cell for cell in found.results.cells if not is_reference(cell.defense)]
    for cell in sorted(judged, key=_damage, reverse=True)[:cells]:
        damage = cell.metrics[DAMAGE]
        order, n = np.argsort(-damage, kind="stable"), len(damage)
        worlds = {"worst": order[0], "median": order[n // 2], "best": order[-1]}
        for name, world in list(worlds.items())[: min(n, 3)]:
            yield cell, int(world), f"{name}: world {world}, damage {damage[world]:.3g}"
