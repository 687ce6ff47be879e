"""The figure of Theorem 1: as published, and beside it our numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from trust_env import theory
from trust_env.training.paper.theorem import N_ADVERSARIES, N_BENIGN, TheoremRow
from trust_env.training.paper.theory_claims import DRAWN_WITH, FIGURE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NEVER = 21.0  # where the figure draws what never happens
ETA = (
    r"$\eta$: dimension of a measurement; a hit adds at most $\ln(P_D / ((2\pi)^{\eta/2} \beta_{FP} \sqrt{\det R}))$ "
    "to the score, so that a higher one takes more frames.\n"
    r"The paper's numbers are those of $\eta = 3$; the positions that our agents report are planar, $\eta = 2$."
)
_COLOURS = {1: "#b03a2e", 2: "#ca8a04", 3: "#2563af"}  # by number of adversaries
_GREY = "#7c8695"


def theorem_figure(rows: Sequence[TheoremRow]) -> Figure:
    """Left as published, right our numbers: the theorem, its corrected bound, and what the simulation needs."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 4.8), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    figure.suptitle("Theorem 1: frames until a false positive is confirmed", fontweight="bold")
    figure.supxlabel(ETA, fontsize=8, color="#4b5563")
    _draw_published_theorem(axes[0])
    _draw_simulated_theorem(axes[1], rows)
    for axis in axes:
        axis.set_xlabel("honest agents that see the place, $K_b$")
        axis.axhline(NEVER, color=_GREY, lw=0.8, ls=(0, (2, 3)))
    axes[0].set(ylabel="frames", ylim=(0, NEVER + 1.4))
    axes[0].set_yticks([1, 5, 10, 15, NEVER], ["1", "5", "10", "15", "never"])
    return figure


def _draw_published_theorem(axis: Axes) -> None:
    axis.set_title(r"as published: $\eta = 3$, $\alpha = 10^{-4}$ (its caption says $10^{-6}$)")
    for n_adversaries in N_ADVERSARIES:
        colour = _COLOURS[n_adversaries]
        frames = [theory.frames_to_confirm(n_adversaries, b, **DRAWN_WITH) for b in N_BENIGN]
        _draw_frames(axis, frames, colour)
        axis.plot(N_BENIGN, _drawn_frames(frames), "o", ms=4, color=colour)
        axis.plot([], [], "o-", ms=4, color=colour, label=f"$K_a = {n_adversaries}$")
    for (_, n_benign), value in FIGURE.items():
        axis.plot(n_benign, value, "o", ms=10, mfc="none", mec="black", mew=1.0)
        axis.annotate(
            f"{value:.2f}",
            (n_benign, value),
            xytext=(-4, 9),
            textcoords="offset points",
            ha="right",
            fontsize=8,
        )
    axis.plot([], [], "o", ms=9, mfc="none", mec="black", label="values in the paper's figure")
    axis.legend(loc="upper left", bbox_to_anchor=(0.0, 0.93))


def _draw_simulated_theorem(axis: Axes, rows: Sequence[TheoremRow]) -> None:
    axis.set_title(r"here: $\eta = 2$, $\alpha = 10^{-4}$, simulated centre")
    shift = {1: 0.0, 2: -0.13, 3: 0.13}
    for n_adversaries in N_ADVERSARIES:
        team = [row for row in rows if row.n_adversaries == n_adversaries]
        colour = _COLOURS[n_adversaries]
        first = [row for row in team if row.order == "first"]
        _draw_frames(axis, [row.theorem for row in first], colour)
        axis.plot(N_BENIGN, _drawn_frames(row.bound for row in first), "_", ms=16, mew=1.6, color=colour)
        for order, sign in (("first", "^"), ("last", "v")):
            points = [row for row in team if row.order == order]
            axis.plot(
                [row.n_benign + shift[n_adversaries] for row in points],
                _drawn_frames(row.simulated for row in points),
                sign, ms=6.5, color=colour, mec="white", mew=0.6,
            )  # fmt: skip
    for sign, label in (
        ("-", r"Theorem 1, $T_{min}$"),
        ("_", r"corrected bound, $\lceil T_{seq} \rceil$"),
        ("^", "simulated, adversaries first"),
        ("v", "simulated, adversaries last"),
    ):
        axis.plot([], [], sign, color="#4b5563", ms=7, label=label)
    axis.legend(loc="upper left", bbox_to_anchor=(0.0, 0.93))


def _draw_frames(axis: Axes, frames: Sequence[float], colour: str) -> None:
    """A line over K_b = 0, 1, ...; dashed where it goes to "never"."""
    finite = [f for f in frames if math.isfinite(f)]
    axis.plot(N_BENIGN[: len(finite)], finite, "-", lw=1.5, color=colour)
    last = len(finite) - 1
    dashed = {"ls": (0, (3, 3)), "lw": 0.9}
    axis.plot(N_BENIGN[last:], _drawn_frames(frames[last:]), color=colour, **dashed)


def _drawn_frames(frames: Iterable[float]) -> list[float]:
    """Where frames are drawn: what never happens at `NEVER`."""
    return [min(f, NEVER) for f in frames]
