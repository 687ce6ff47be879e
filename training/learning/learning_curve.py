"""The learning curve of training runs: damage at their evaluations, as a figure."""

from __future__ import annotations

import csv
import importlib.util
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from trust_env.files import write_atomically

CURVE, _EVALUATIONS, _DAMAGE = "curve.png", "evaluations.csv", "damage_per_frame"


def draw_curve(folders: Sequence[Path], file: Path) -> bool:
    """Draw a line for every run, and their mean where all were evaluated at the same steps, into a PNG; False:
    matplotlib, which draws it, is not installed.
    """
    if importlib.util.find_spec("matplotlib") is None:
        return False
    from matplotlib.figure import Figure

    curves = [read_curve(folder) for folder in folders]
    figure = Figure(figsize=(6.0, 3.6), layout="constrained")
    axis = figure.subplots()
    for folder, (steps, damage) in zip(folders, curves):
        axis.plot(steps, damage, color="#2563af", lw=1.2, marker=".", alpha=0.5 if curves[1:] else 1.0)
        axis.annotate(folder.name, (steps[-1], damage[-1]), (4, 0), textcoords="offset points", fontsize=8, va="center")
    if curves[1:] and all(np.array_equal(steps, curves[0][0]) for steps, _ in curves):
        mean = np.mean([damage for _, damage in curves], axis=0)
        axis.plot(curves[0][0], mean, color="#b03a2e", lw=2, label=f"mean of {len(curves)} runs")
        axis.legend()
    axis.set(
        xlabel="steps of all learners", ylabel="damage per frame, held-out worlds", ylim=(0.0, None), xlim=(0.0, None)
    )
    axis.spines[["top", "right"]].set_visible(False)  # the names stand there
    axis.margins(x=0.0)
    axis.grid(color="#e5e7eb")
    write_atomically(file, lambda path: figure.savefig(path, dpi=120, format="png"))
    return True


def read_curve(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Steps and mean damage per frame of the evaluations of a run."""
    with open(folder / _EVALUATIONS, newline="", encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    return np.array([float(row["steps"]) for row in rows]), np.array([float(row[_DAMAGE]) for row in rows])
