"""The figure of Theorem 1 as a surface over the numbers of adversaries and of honest agents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trust_env import theory
from trust_env.training.paper.theorem import N_ADVERSARIES, N_BENIGN, TheoremRow
from trust_env.training.paper.theorem_figure import ETA, NEVER
from trust_env.training.paper.theory_claims import DRAWN_WITH, FIGURE

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def surface_figure(rows: Sequence[TheoremRow]) -> Figure:
    """Left T_min as published, right T_min here, and what the simulation needs with the adversaries first."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 5.5), layout="constrained")
    figure.suptitle("Theorem 1: frames until a false positive is confirmed", fontweight="bold")
    figure.supxlabel(ETA, fontsize=8, color="#4b5563")
    simulated = {(row.n_adversaries, row.n_benign): row.simulated for row in rows if row.order == "first"}
    titles = r"as published: $\eta = 3$, $\alpha = 10^{-4}$", r"here: $\eta = 2$, $\alpha = 10^{-4}$"
    _draw_surface(figure.add_subplot(1, 2, 1, projection="3d"), titles[0], DRAWN_WITH, FIGURE, "in the paper's figure")
    _draw_surface(
        figure.add_subplot(1, 2, 2, projection="3d"), titles[1], {}, simulated, "simulated, adversaries first"
    )
    return figure


def t_min_surface(**arguments: Any) -> np.ndarray:
    """T_min of Theorem 1, [K_a, K_b]; infinite where an FP is never confirmed."""
    return np.array([[theory.frames_to_confirm(a, b, **arguments) for b in N_BENIGN] for a in N_ADVERSARIES])


def _draw_surface(
    axis: Any, title: str, arguments: Mapping[str, Any], points: Mapping[tuple[int, int], float], label: str
) -> None:
    """The surface, cut off at `NEVER`, and points by (K_a, K_b)."""
    benign, adversaries = np.meshgrid(N_BENIGN, N_ADVERSARIES)
    frames = np.minimum(t_min_surface(**arguments), NEVER)
    axis.plot_surface(benign, adversaries, frames, cmap="viridis", alpha=0.55, edgecolor="#4b5563", linewidth=0.5)
    places = [(b, a, min(frame, NEVER)) for (a, b), frame in points.items()]
    axis.plot(*zip(*places, strict=True), "o", ms=4, color="#b03a2e", label=label)
    axis.set(title=title, xlabel="honest agents $K_b$", ylabel="adversaries $K_a$", zlim=(0, NEVER))
    axis.set_yticks(N_ADVERSARIES)
    axis.set_zticks([1, 5, 10, 15, NEVER], ["1", "5", "10", "15", "never"])
    axis.view_init(elev=24, azim=-128)
    axis.legend(loc="upper left")
