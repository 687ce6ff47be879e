"""A cell of an evaluation: one attack against one defense, with the metrics of every episode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from trust_env.metrics import METRICS, RELIABILITY
from trust_env.metrics.strata import Strata, Stratum, merge_strata
from trust_env.training.evaluation.details import Details, Key, details_of
from trust_env.training.evaluation.pooling import pool
from trust_env.training.evaluation.summary import Summary, summarise, without_nan


@dataclass(frozen=True, eq=False)
class Cell:
    """One attack against one defense: `metrics[name]` is float64[episodes], NaN where undefined.

    reliability: trust as a forecast, by episode, as `EpisodeMetrics.reliability`. strata: means over all episodes, by
    who watches. details: the course of its frames; None: a cell of a folder without it.
    """

    attack: str
    defense: str
    metrics: dict[str, np.ndarray]
    reliability: dict[str, np.ndarray]
    strata: tuple[Stratum, ...]
    details: Details | None = None

    @property
    def key(self) -> Key:
        """Attack and defense."""
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

    def to_dict(self) -> dict[str, Any]:
        """Plain values only, as in results.json."""
        return {
            "attack": self.attack,
            "defense": self.defense,
            "metrics": {name: value.to_dict() for name, value in self.summary.items()},
            "pooled": pool([self.metrics], [self.reliability]),
            "strata": [without_nan(stratum._asdict()) for stratum in self.strata],
        }


class Batch(NamedTuple):
    """Some episodes of a cell, as `EpisodeMetrics` gives them."""

    metrics: dict[str, np.ndarray]
    reliability: dict[str, np.ndarray]
    strata: Strata
    courses: dict[str, np.ndarray]
    scores: np.ndarray


def join_batches(attack: str, defense: str, batches: Sequence[Batch], frames: int) -> Cell:
    """The cell of all episodes, of so many frames each."""
    metrics = {name: np.concatenate([batch.metrics[name] for batch in batches]) for name in METRICS}
    reliability = {kind: np.concatenate([batch.reliability[kind] for batch in batches]) for kind in RELIABILITY}
    strata, total = merge_strata(batch.strata for batch in batches), frames * len(metrics["gospa"])
    means = tuple(sums.means(watchers, total) for watchers, sums in strata.items())
    details = details_of([batch.courses for batch in batches], [batch.scores for batch in batches])
    return Cell(attack, defense, metrics, reliability, means, details)
