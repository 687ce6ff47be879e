"""The learning curves of published training runs, a panel for each defense that they were trained against.

python -m trust_env.training.published.learning_curves runs/* --out docs/pages/learning_curves.png
"""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Annotated

import tyro
from matplotlib.figure import Figure

from trust_env.files import write_atomically
from trust_env.training.learning.learning_curve import read_curve
from trust_env.training.learning.training_folder import TrainingFolder


def draw(
    runs: Annotated[tuple[Path, ...], tyro.conf.Positional],
    out: Annotated[Path, tyro.conf.arg(help="PNG to write")] = Path("docs/pages/learning_curves.png"),
) -> None:
    """Draw damage per frame in held-out worlds over the steps of every run."""
    by_defense: dict[str, list[Path]] = defaultdict(list)
    for run in runs:
        by_defense[TrainingFolder.open(run).configuration().defense].append(run)
    figure = Figure(figsize=(3.0 * len(by_defense), 2.8), layout="constrained")
    for axis, (defense, folders) in zip(figure.subplots(1, len(by_defense), squeeze=False)[0], by_defense.items()):
        for folder in folders:
            steps, damage = read_curve(folder)
            seed = TrainingFolder.open(folder).configuration().seed
            axis.plot(steps / 1e6, damage, lw=1.2, marker=".", label=f"seed {seed}")
        axis.set(title=defense, xlabel="million steps", ylim=(0.0, None), xlim=(0.0, None))
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(color="#e5e7eb")
        axis.legend(fontsize=8)
    figure.axes[0].set_ylabel("damage per frame")
    write_atomically(out, lambda path: figure.savefig(path, dpi=110, format="png"))


if __name__ == "__main__":
    tyro.cli(draw)
