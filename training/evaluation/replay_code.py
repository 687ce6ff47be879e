"""An episode of an evaluation again: as a command that shows it, as lines of Python that begin it."""

from __future__ import annotations

import json
import shlex
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

    def replay_command(self, attack: str, defense: str, seed: int, world: int) -> str:
        """The command that shows an episode again, where the scenario was named."""
        changes = dict(self.changes)
        data = changes.pop("targets.data", None)
        words = ["trust-env", "replay", "--scenario", str(self.source), "--attack", attack, "--defense", defense]
        words += ["--seed", str(seed), "--world", str(world)]
        words += [] if data is None else ["--data", str(data)]
        words += [] if self.max_cycles is None else ["--max-cycles", str(self.max_cycles)]
        words += [word for name, value in changes.items() for word in ("--set", f"{name}={json.dumps(value)}")]
        return shlex.join(words)


def worst_world(cell: Cell, metric: str) -> int:
    """The world in which a metric is worst, the first of those."""
    values = cell.metrics[metric]
    return int(np.nanargmax(values) if METRICS[metric].worse == "higher" else np.nanargmin(values))
