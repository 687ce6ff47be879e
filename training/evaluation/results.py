"""The results of an evaluation: a cell for every attack and defense, all on the same episodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from trust_env.defenses import named_in_full
from trust_env.errors import unknown_name
from trust_env.metrics import METRICS, RELIABILITY
from trust_env.metrics.forecast_scores import N_BINS
from trust_env.metrics.strata import Stratum
from trust_env.training.evaluation.cell import Cell, Key
from trust_env.training.evaluation.pooling import pool
from trust_env.training.evaluation.replay_code import Setting
from trust_env.training.evaluation.statistics import (
    Bounds,
    Interval,
    paired_difference,
    paired_mean_difference,
    placed_between,
)
from trust_env.training.evaluation.summary import without_nan

if TYPE_CHECKING:
    import pyarrow as pa

DAMAGE = "damage_per_frame"
REFERENCES = ("oracle", "blank")  # the defenses between which damage is placed: knows the roles, shows nothing


@dataclass(frozen=True, eq=False)
class Results:
    """Cells, all over the same episodes (worlds 0, 1, ... of one seed), so that they compare in pairs.

    knowledge: the level that all cells were played at, which may be above the scenario's. `replay_code` begins an
    episode again.
    """

    scenario: str
    seed: int
    episodes: int
    version: str
    cells: tuple[Cell, ...]
    notes: tuple[str, ...] = field(default=())
    knowledge: str = "own"
    setting: Setting = field(default_factory=Setting)

    def __getitem__(self, key: Key) -> Cell:
        """The cell of an attack and a defense, by their names; of the default preset also as plain `trust`."""
        attack, defense = key
        for cell in self.cells:
            if cell.key in ((attack, defense), (attack, _in_full(defense))):
                return cell
        raise unknown_name("cell", " x ".join(key), (" x ".join(cell.key) for cell in self.cells))

    def difference(self, cell_a: Key | Cell, cell_b: Key | Cell, metric: str) -> Interval | None:
        """How much higher a metric's interquartile mean is in cell a than in cell b, by paired episodes; None:
        undefined.
        """
        return paired_difference(*self._pair(cell_a, cell_b, metric))

    def mean_difference(self, cell_a: Key | Cell, cell_b: Key | Cell, metric: str) -> Bounds | None:
        """The same of the means."""
        return paired_mean_difference(*self._pair(cell_a, cell_b, metric))

    def _pair(self, cell_a: Key | Cell, cell_b: Key | Cell, metric: str) -> tuple[np.ndarray, np.ndarray]:
        if metric not in METRICS:
            raise unknown_name("metric", metric, METRICS)
        a, b = (cell if isinstance(cell, Cell) else self[cell] for cell in (cell_a, cell_b))
        return a.metrics[metric], b.metrics[metric]

    def replay_code(self, key: Key | Cell, world: int) -> str:
        """Lines of Python that begin an episode of a cell again, with everything that they need."""
        cell = key if isinstance(key, Cell) else self[key]
        return self.setting.replay_code(cell.attack, cell.defense, self.seed, world)

    def to_dict(self) -> dict[str, Any]:
        """Plain values only, as in results.json."""
        return {
            "scenario": self.scenario,
            "knowledge": self.knowledge,
            "seed": self.seed,
            "episodes": self.episodes,
            "version": self.version,
            "cells": [cell.to_dict() | self._place_of(cell) for cell in self.cells],
            "pooled": self.pooled(),
        }

    def pooled(self) -> list[dict[str, Any]]:
        """Scores of trust over all attacks on a defense together, for every defense, as plain values."""
        found = []
        for defense in dict.fromkeys(cell.defense for cell in self.cells):
            cells = [cell for cell in self.cells if cell.defense == defense]
            scores = pool([cell.metrics for cell in cells], [cell.reliability for cell in cells])
            found.append({"defense": defense, "attacks": [cell.attack for cell in cells], **scores})
        return found

    def placed_damage(self, cell: Cell) -> Bounds | None:
        """Mean damage on a scale on which `oracle` under the same attack is 0 and `blank` is 1, by paired episodes.

        None where one of the two is missing, or `blank` does no more damage than `oracle`.
        """
        low, high = (self._reference(cell.attack, name) for name in REFERENCES)
        if low is None or high is None:
            return None
        return placed_between(cell.metrics[DAMAGE], low.metrics[DAMAGE], high.metrics[DAMAGE])

    def _reference(self, attack: str, name: str) -> Cell | None:
        """The cell of an attack and a defense of this name, the one without arguments first."""
        found = [c for c in self.cells if c.attack == attack and c.defense.partition("(")[0] == name]
        return min(found, key=lambda cell: len(cell.defense), default=None)

    def _place_of(self, cell: Cell) -> dict[str, Any]:
        place = self.placed_damage(cell)
        return {} if place is None else {"placed_damage": without_nan(place._asdict())}

    def strata(self) -> list[list[list[Any]]]:
        """The strata of every cell, in their order, as plain values, null where absent."""
        return [[list(without_nan(stratum._asdict()).values()) for stratum in cell.strata] for cell in self.cells]

    def to_arrow(self) -> pa.Table:
        """A row per episode, as in results.parquet: what names it, every metric, null where undefined."""
        import pyarrow as pa

        n, cells = self.episodes, self.cells
        columns: dict[str, pa.Array] = {
            "attack": pa.array([c.attack for c in cells for _ in range(n)], pa.string()),
            "defense": pa.array([c.defense for c in cells for _ in range(n)], pa.string()),
            "scenario": pa.array([self.scenario] * (n * len(cells)), pa.string()),
            "seed": pa.array(np.full(n * len(cells), self.seed, np.int64)),
            "world": pa.array(np.tile(np.arange(n), len(cells)).astype(np.int64)),
            "episode": pa.array(np.zeros(n * len(cells), np.int64)),
            "version": pa.array([self.version] * (n * len(cells)), pa.string()),
        }
        for name in METRICS:
            values = np.concatenate([np.empty(0), *(cell.metrics[name] for cell in cells)])
            columns[name] = pa.array(values, from_pandas=True)  # NaN becomes null
        for kind in RELIABILITY:
            sums = np.concatenate([np.empty((0, 3 * N_BINS)), *(_flat(cell.reliability[kind]) for cell in cells)])
            columns[f"{kind}_bins"] = pa.array(list(sums), pa.list_(pa.float64()))
        return pa.table(columns)


def _in_full(defense: str) -> str:
    """A defense's name with its preset; that of an object as it is."""
    try:
        return named_in_full(defense)
    except ValueError:
        return defense


def _flat(bins: np.ndarray) -> np.ndarray:
    return bins.reshape(len(bins), -1)


def cells_of(table: pa.Table, strata: Sequence[Sequence[Sequence[Any]]]) -> list[Cell]:
    """The cells in a table of `Results.to_arrow`, in its order, with those of `Results.strata`."""
    keys = list(zip(table["attack"].to_pylist(), table["defense"].to_pylist()))
    rows: dict[Key, list[int]] = {}
    for row, key in enumerate(keys):
        rows.setdefault(key, []).append(row)
    values = {name: _floats(table[name]) for name in METRICS}
    bins = {kind: np.array(table[f"{kind}_bins"].to_pylist()).reshape(-1, 3, N_BINS) for kind in RELIABILITY}
    cells = []
    for (key, at), strata_of_cell in zip(rows.items(), strata, strict=True):
        metrics = {name: column[at] for name, column in values.items()}
        reliability = {kind: column[at] for kind, column in bins.items()}
        cells.append(Cell(*key, metrics, reliability, tuple(_stratum(row) for row in strata_of_cell)))
    return cells


def _stratum(row: Sequence[Any]) -> Stratum:
    adversaries, benign, *means = row
    return Stratum(adversaries, benign, *(np.nan if mean is None else mean for mean in means))


def _floats(column: Any) -> np.ndarray:
    return np.asarray(column.to_numpy(zero_copy_only=False), dtype=np.float64)
