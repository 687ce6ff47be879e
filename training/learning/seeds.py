"""The same training with several seeds, each in a folder of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from trust_env.errors import positive_int
from trust_env.files import expanded
from trust_env.training.evaluation.run_folder import require_same_configuration
from trust_env.training.learning.configuration import load_configuration
from trust_env.training.learning.learning_curve import CURVE, draw_curve
from trust_env.training.learning.next_step import next_step
from trust_env.training.learning.train import TrainingRun, configured, given_fields, train
from trust_env.training.learning.training_folder import CONFIG


@dataclass(frozen=True)
class TrainingRuns:
    """The runs of several seeds, in the folder that holds theirs."""

    folder: Path
    runs: tuple[TrainingRun, ...]

    def to_dict(self) -> dict[str, Any]:
        """The runs as built-in values, for JSON."""
        return {"folder": str(self.folder), "runs": [run.to_dict() for run in self.runs]}

    def describe(self) -> str:
        """Damage over the seeds, where the learning curves are, and the command that evaluates all."""
        damage = np.array([run.evaluations[-1]["damage_per_frame"] for run in self.runs])
        curve = self.folder / CURVE
        return "\n".join([
            f"{self.folder}: {len(self.runs)} runs, damage per frame {damage.mean():.2f} on held-out worlds "
            f"(mean; {damage.min():.2f} to {damage.max():.2f})",
            *([f"their learning curves: {curve}"] if curve.is_file() else []),
            next_step([run.folder for run in self.runs]),
        ])  # fmt: skip


def train_seeds(
    seeds: int, out: str | Path, seed: int | None = None, overrides: Mapping[str, Any] | None = None, **arguments: Any
) -> TrainingRuns:
    """Train with `seeds` seeds from `seed` on (0), in the folders seed_0, seed_1, ... of `out`; other arguments as of
    `train`. Runs that are there already are continued, and kept where they are finished.

    ValueError, beside those of `train`: a folder holds a run of another configuration.
    """
    first, folder = 0 if seed is None else seed, expanded(out)
    given = {"overrides": overrides, **arguments}
    numbers = range(first, first + positive_int("seeds", seeds))
    runs = tuple(_run(folder / f"seed_{number}", number, given) for number in numbers)
    draw_curve([run.folder for run in runs], folder / CURVE)
    return TrainingRuns(folder, runs)


def _run(folder: Path, seed: int, arguments: Mapping[str, Any]) -> TrainingRun:
    """A new run, or the rest of the one in the folder."""
    if not (folder / CONFIG).is_file():
        return train(out=folder, seed=seed, **arguments)
    fields = {name: value for name, value in arguments.items() if name not in ("scenario", "config", "progress")}
    config, _ = configured(arguments.get("scenario"), arguments.get("config"), given_fields(seed=seed, **fields))
    saved = load_configuration(folder / CONFIG).model_dump(mode="json")
    require_same_configuration(folder, saved, config.model_dump(mode="json"))
    return train(resume=folder, progress=arguments.get("progress", True))
