"""Small training runs, and what their folders hold."""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from typing import Any

import numpy as np

from trust_env import training
from trust_env.agents.learned.policy_file import load_policy

PROGRAM = [sys.executable, "-m", "trust_env.training.cli", "train"]
SMALL = {
    "scenario": "trio(horizon=20)",
    "worlds": 16,
    "steps": 1300,  # three rollouts of 16 worlds x 1 adversary x 32 frames
    "ppo": {"n_steps": 32, "batch_size": 128, "n_epochs": 2},
    "normalise": {"observations": True},
    "evaluation": {"every": 600, "episodes": 4},
    "checkpoint": {"every": 0},
}
ROLLOUT = 512


def train(**arguments: Any) -> Any:
    """A small training run, but for these arguments."""
    return training.train(**{"config": SMALL, "progress": False} | arguments)


def weights(folder: Path) -> dict[str, np.ndarray]:
    return load_policy(folder)[0]


def same(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


def lines(file: Path) -> list[dict[str, str]]:
    """The rows of a CSV, without the columns that depend on the clock."""
    with open(file, newline="", encoding="utf-8") as opened:
        rows = list(csv.DictReader(opened))
    return [{k: v for k, v in row.items() if k not in ("seconds", "steps_per_second")} for row in rows]


def logged(folder: Path) -> list[tuple[str, int, float]]:
    """Tag, step and value of all that TensorBoard shows, without what depends on the clock."""
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    found = []
    for file in sorted((folder / "tensorboard").iterdir()):
        events = EventAccumulator(str(file), size_guidance={"scalars": 0})
        events.Reload()
        for tag in events.Tags()["scalars"]:
            if not tag.startswith("time/"):
                found += [(tag, event.step, event.value) for event in events.Scalars(tag)]
    return sorted(found)


def interrupted(folder: Path, steps: int) -> None:
    """Make a finished run one that was killed just after its checkpoint at `steps`, with newer lines."""
    for file in (folder / "checkpoints").iterdir():
        if int(file.stem) > steps:
            file.unlink()


def saved(folder: Path) -> set[str]:
    return {file.name for file in (folder / "checkpoints").glob("*.zip")}
