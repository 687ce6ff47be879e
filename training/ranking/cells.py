"""The cells of a ranking: an attack on a defense in episodes that choose the worst attack, and in others to report."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trust_env.training.evaluation.cell import Cell
from trust_env.training.evaluation.results import DAMAGE


class Cells(NamedTuple):
    """`validation` chooses; `reported` is what rows are made of."""

    validation: Cell
    reported: Cell

    @property
    def chosen_by(self) -> float:
        """Mean damage in the validation episodes."""
        return float(self.validation.metrics[DAMAGE].mean())

    @property
    def damage(self) -> np.ndarray:
        """Damage per frame in the reported episodes, float64[episodes]."""
        return self.reported.metrics[DAMAGE]


def split(cell: Cell, validation: int) -> Cells:
    """A cell as the first so many episodes and the rest."""
    return Cells(_episodes(cell, slice(validation)), _episodes(cell, slice(validation, None)))


def _episodes(cell: Cell, kept: slice) -> Cell:
    """Some episodes of a cell, without what is not kept by episode."""
    metrics = {name: values[kept] for name, values in cell.metrics.items()}
    reliability = {kind: bins[kept] for kind, bins in cell.reliability.items()}
    return Cell(cell.attack, cell.defense, metrics, reliability, ())
