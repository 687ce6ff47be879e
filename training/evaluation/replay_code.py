"""An episode of an evaluation as lines of Python that begin it again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from trust_env.metrics import METRICS
from trust_env.training.evaluation.cell import Cell


@dataclass(frozen=True)
class Setting:
    """What all cells of an evaluation were played on. source: as it was named, None for an object; changes: of its
    fields, by dotted name, the knowledge level that the attacks need among them; max_cycles: None, or in place of
    the horizon.
    """

    source: str | None = None
    changes: Mapping[str, Any] = field(default_factory=dict)
    max_cycles: int | None = None

    def replay_code(self, attack: str, defense: str, seed: int, world: int) -> str:
        """Python that begins an episode again; after it `env.step(player.actions(observations))` plays on.

        Attack and defense stand there by their names; who evaluated objects puts them in.
        """
        source = "scenario" if self.source is None else repr(self.source)
        if self.changes:
            source = f"trust_env.load_scenario({source}, **{dict(self.changes)!r})"
        cycles = "" if self.max_cycles is None else f", max_cycles={self.max_cycles}"
        return (
            f"env = trust_env.parallel_env({source}, {defense!r}{cycles})\n"
            f"player = trust_env.agents.Player(env, {{'adversary': {attack!r}}})\n"
            f"observations, infos = env.reset(seed={seed}, options={{'world': {world}, 'episode': 0}})"
        )


def worst_world(cell: Cell, metric: str) -> int:
    """The world in which a metric is worst, the first of those."""
    values = cell.metrics[metric]
    return int(np.nanargmax(values) if METRICS[metric].worse == "higher" else np.nanargmin(values))
