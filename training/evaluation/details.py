"""What is kept of a cell beside the metrics of its episodes: the course of a frame's damage and trust, and how trust
tells adversaries apart. It goes to courses.parquet, with a row for every cell and frame.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from trust_env.metrics.course_record import COURSES

if TYPE_CHECKING:
    import pyarrow as pa

Key = tuple[str, str]  # attack, defense
QUANTILES = (0.1, 0.5, 0.9)
STATISTICS = ("mean", "q10", "q50", "q90")  # over the episodes that define the value
_SCORES = b"trust_env.scores"


@dataclass(frozen=True, eq=False)
class Details:
    """courses: by name of `COURSES` float[T, 4], its `STATISTICS` in every frame, NaN where no episode defines it.

    scores: int[2, N_SCORES], as `EpisodeMetrics.trust_scores` gives them, of all episodes.
    """

    courses: dict[str, np.ndarray]
    scores: np.ndarray


def details_of(courses: Sequence[Mapping[str, np.ndarray]], scores: Sequence[np.ndarray]) -> Details:
    """Those of a cell from those of its batches: courses float[W, T] by name, and scores."""
    found = {name: _statistics(np.concatenate([batch[name] for batch in courses])) for name in COURSES}
    return Details(found, np.sum(scores, axis=0))


def _statistics(values: np.ndarray) -> np.ndarray:
    """`STATISTICS` over the episodes of values[W, T]: float[T, 4]."""
    found = np.full((values.shape[1], len(STATISTICS)), np.nan)
    defined = ~np.isnan(values).all(axis=0)
    if defined.any():
        found[defined, 0] = np.nanmean(values[:, defined], axis=0)
        found[defined, 1:] = np.nanquantile(values[:, defined], QUANTILES, axis=0).T
    return found


def to_arrow(details: Mapping[Key, Details]) -> pa.Table:
    """A row per cell and frame, counted from 1; null where undefined; the scores stand among the metadata."""
    import pyarrow as pa

    lengths = [len(each.courses[COURSES[0]]) for each in details.values()]
    names = [np.repeat([key[i] for key in details], lengths).tolist() for i in range(2)]
    columns: dict[str, Any] = {name: pa.array(found, pa.string()) for name, found in zip(("attack", "defense"), names)}
    frames = np.concatenate([np.empty(0, int), *(np.arange(1, length + 1) for length in lengths)])
    columns["frame"] = pa.array(frames, pa.int64())
    for name in COURSES:
        values = np.concatenate([np.empty((0, len(STATISTICS))), *(each.courses[name] for each in details.values())])
        for column, statistic in zip(values.T, STATISTICS):
            columns[f"{name}_{statistic}"] = pa.array(column, pa.float64(), from_pandas=True)
    scores = [[*key, each.scores.tolist()] for key, each in details.items()]
    return pa.table(columns).replace_schema_metadata({_SCORES: json.dumps(scores)})


def details_in(table: pa.Table) -> dict[Key, Details]:
    """The details of every cell in a table of `to_arrow`. KeyError or ValueError: it is none."""
    scores = {(attack, defense): counts for attack, defense, counts in json.loads(table.schema.metadata[_SCORES])}
    rows: dict[Key, list[int]] = {key: [] for key in scores}
    for row, key in enumerate(zip(table["attack"].to_pylist(), table["defense"].to_pylist())):
        rows[key].append(row)
    values = {
        name: np.stack([np.asarray(table[f"{name}_{s}"], dtype=np.float64) for s in STATISTICS], axis=1)
        for name in COURSES
    }
    return {
        key: Details({name: values[name][at] for name in COURSES}, np.array(scores[key])) for key, at in rows.items()
    }
