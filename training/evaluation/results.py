"""The results of an evaluation: a cell for every attack and defense, with the metrics of every episode."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from trust_env.defenses import named_in_full
from trust_env.errors import unknown_name
from trust_env.metrics import METRICS
from trust_env.training.evaluation.statistics import Bounds, Interval, paired_difference, paired_mean_difference
from trust_env.training.evaluation.summary import Summary, summarise

if TYPE_CHECKING:
    import pyarrow as pa

Key = tuple[str, str]  # attack, defense


@dataclass(frozen=True, eq=False)
class Cell:
    """One attack against one defense: `metrics[name]` is float64[episodes], NaN where undefined."""

    attack: str
    defense: str
    metrics: dict[str, np.ndarray]

    @property
    def key(self) -> Key:
        return self.attack, self.defense

    @cached_property
    def summary(self) -> dict[str, Summary]:
        """Means and 95 % intervals by metric; a metric that no episode defines, nor means "never", is absent."""
        return summarise(self.metrics)

    @property
    def is_undecided(self) -> bool:
        """Whether tracks were confirmed, the defense's trust in every one was NaN, and it rejected none."""
        found = self.metrics
        has_tracks = not np.isnan(found["existence_brier"]).all()
        has_opinions = not np.isnan(found["track_trust_brier"]).all()
        rejects = any((found[f"{kind}_track_rejection_rate"] > 0.0).any() for kind in ("true", "false"))
        return has_tracks and not has_opinions and not rejects


@dataclass(frozen=True, eq=False)
class Results:
    """Cells, all over the same episodes (worlds 0, 1, ... of one seed), so that they compare in pairs.

    To replay row w: `parallel_env(scenario, defense).reset(seed=seed, options={"world": w, "episode": 0})`.
    """

    scenario: str
    seed: int
    episodes: int
    version: str
    cells: tuple[Cell, ...]
    notes: tuple[str, ...] = field(default=())

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

    def to_dict(self) -> dict[str, Any]:
        """Plain values only, as in results.json."""
        return {
            "scenario": self.scenario,
            "seed": self.seed,
            "episodes": self.episodes,
            "version": self.version,
            "cells": [
                {
                    "attack": cell.attack,
                    "defense": cell.defense,
                    "metrics": {name: value.to_dict() for name, value in cell.summary.items()},
                }
                for cell in self.cells
            ],
        }

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
        return pa.table(columns)


def _in_full(defense: str) -> str:
    """A defense's name with its preset; that of an object as it is."""
    try:
        return named_in_full(defense)
    except ValueError:
        return defense


def cells_of(table: pa.Table) -> list[Cell]:
    """The cells in a table of `Results.to_arrow`, in its order."""
    keys = list(zip(table["attack"].to_pylist(), table["defense"].to_pylist()))
    rows: dict[Key, list[int]] = {}
    for row, key in enumerate(keys):
        rows.setdefault(key, []).append(row)
    values = {name: _floats(table[name]) for name in METRICS}
    return [Cell(*key, {name: column[at] for name, column in values.items()}) for key, at in rows.items()]


def _floats(column: Any) -> np.ndarray:
    return np.asarray(column.to_numpy(zero_copy_only=False), dtype=np.float64)
