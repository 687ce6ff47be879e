"""The figures of `reproduce` as PNGs: Theorem 1, and the eight trust panels over the published curves."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trust_env import theory
from trust_env.training.paper.published import Panel, PanelKey, objects
from trust_env.training.paper.theorem import N_ADVERSARIES, N_BENIGN, TheoremRow
from trust_env.training.paper.theory_claims import DRAWN_WITH, FIGURE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NEVER = 21.0  # where the figure draws what never happens
_TEAM = {1: "#b03a2e", 2: "#ca8a04", 3: "#2563af"}  # by number of adversaries
_AGENTS = ("#2563af", "#0f8750", "#b03a2e")
_TARGETS, _FALSE = ("#2563af", "#0891b2", "#0f8750", "#6d5ac7"), ("#b03a2e", "#e08214")
_STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e5e9ef",
    "axes.axisbelow": True,
    "axes.edgecolor": "#7c8695",
    "axes.titlesize": 10,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "savefig.dpi": 150,
}


def require_matplotlib() -> None:
    """Raises ImportError, naming the extra, where matplotlib is missing."""
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise ImportError('figures need matplotlib: pip install "trust-env[plot]"') from error


def write_figures(
    folder: Path, rows: Sequence[TheoremRow], panels: Mapping[str, Mapping[PanelKey, Panel]]
) -> tuple[Path, ...]:
    """Write all figures into a folder, which is made if need be; their paths."""
    require_matplotlib()
    from matplotlib import rc_context

    folder.mkdir(parents=True, exist_ok=True)
    with rc_context(_STYLE):
        figures = {"theorem_1.png": theorem_figure(rows)} | {
            f"trust_{preset}.png": panel_figure(panels["published"], panels[preset], preset)
            for preset in ("cdc2024", "paper")
        }
        for name, figure in figures.items():
            figure.savefig(folder / name)
    return tuple(folder / name for name in figures)


def _figure(width: float, height: float, rows: int, columns: int, **shared: Any) -> tuple[Figure, np.ndarray]:
    """A figure without a window, and its axes [rows, columns]."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **shared)


# --- Theorem 1 ------------------------------------------------------------------------------------------


def theorem_figure(rows: Sequence[TheoremRow]) -> Figure:
    """Left as published, right our numbers: the theorem, its exact bound, and what the simulation needs."""
    figure, axes = _figure(10.0, 4.4, 1, 2, sharey=True)
    figure.suptitle("Theorem 1: frames until a false positive is confirmed", fontweight="bold")
    _draw_published_theorem(axes[0, 0])
    _draw_simulated_theorem(axes[0, 1], rows)
    for axis in axes[0]:
        axis.set_xlabel("honest agents that see the place, $K_b$")
        axis.axhline(NEVER, color="#7c8695", lw=0.8, ls=(0, (2, 3)))
    axes[0, 0].set(ylabel="frames", ylim=(0, NEVER + 1.4))
    axes[0, 0].set_yticks([1, 5, 10, 15, NEVER], ["1", "5", "10", "15", "never"])
    return figure


def _draw_published_theorem(axis: Axes) -> None:
    axis.set_title(r"as published: $\eta = 3$, $\alpha = 10^{-4}$ (its caption says $10^{-6}$)")
    for n_adversaries in N_ADVERSARIES:
        colour = _TEAM[n_adversaries]
        frames = [theory.frames_to_confirm(n_adversaries, b, **DRAWN_WITH) for b in N_BENIGN]
        _draw_frames(axis, frames, colour)
        axis.plot(N_BENIGN, _clipped(frames), "o", ms=4, color=colour)
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
        colour = _TEAM[n_adversaries]
        first = [row for row in team if row.order == "first"]
        _draw_frames(axis, [row.theorem for row in first], colour)
        axis.plot(N_BENIGN, _clipped(row.bound for row in first), "_", ms=16, mew=1.6, color=colour)
        for order, sign in (("first", "^"), ("last", "v")):
            points = [row for row in team if row.order == order]
            axis.plot(
                [row.n_benign + shift[n_adversaries] for row in points],
                _clipped(row.simulated for row in points),
                sign, ms=6.5, color=colour, mec="white", mew=0.6,
            )  # fmt: skip
    for sign, label in (
        ("-", r"Theorem 1, $T_{min}$"),
        ("_", r"exact bound, $\lceil T_{seq} \rceil$"),
        ("^", "simulated, adversaries first"),
        ("v", "simulated, adversaries last"),
    ):
        axis.plot([], [], sign, color="#4b5563", ms=7, label=label)
    axis.legend(loc="upper left", bbox_to_anchor=(0.0, 0.93))


def _draw_frames(axis: Axes, frames: Sequence[float], colour: str) -> None:
    """A line over K_b = 0, 1, ...; dashed where it goes to "never"."""
    finite = [f for f in frames if math.isfinite(f)]
    axis.plot(N_BENIGN[: len(finite)], finite, "-", lw=1.5, color=colour)
    axis.plot(
        N_BENIGN[len(finite) - 1 :], _clipped(frames[len(finite) - 1 :]), ls=(0, (3, 3)), lw=0.9, color=colour
    )


def _clipped(frames: Iterable[float]) -> list[float]:
    return [min(f, NEVER) for f in frames]


# --- trust panels ---------------------------------------------------------------------------------------


def panel_figure(published: Mapping[PanelKey, Panel], ours: Mapping[PanelKey, Panel], preset: str) -> Figure:
    """Tracks above, agents below; lines are ours, dots the authors' own numbers."""
    figure, axes = _figure(13.0, 6.6, 2, len(published), sharex=True, sharey=True)
    figure.suptitle(
        f"Trust in the two case studies: lines ours (preset {preset}), dots published", fontweight="bold"
    )
    for column, key in enumerate(published):
        case, trusted = key
        title = f"Case {case[-1]}, {'strong prior on agent 1' if trusted else 'no prior'}"
        axes[0, column].set_title(title)
        labels, colours = _track_styles(case)
        _draw_curves(axes[0, column], published[key].tracks, ours[key].tracks, labels, colours)
        names = [f"agent {k}" for k in range(len(_AGENTS))]
        _draw_curves(axes[1, column], published[key].agents, ours[key].agents, names, _AGENTS)
        axes[1, column].set_xlabel("frame")
        axes[0, column].legend(loc="upper center", bbox_to_anchor=(0.5, -0.04), ncols=1, handlelength=1.2)
    axes[0, 0].set(ylabel="trust in the tracks", ylim=(0, 1), xlim=(0, 20.5), xticks=range(0, 21, 5))
    axes[1, 0].set_ylabel("trust in the agents")
    axes[1, -1].legend(loc="lower right", ncols=1, handlelength=1.2)
    return figure


def _track_styles(case: str) -> tuple[list[str], list[str]]:
    """Names and colours of a case's tracks: reds for false positives."""
    things, used = objects(case), {"true": 0, "fp": 0}
    colours = []
    for thing in things:
        colours.append((_FALSE if thing.kind == "fp" else _TARGETS)[used[thing.kind]])
        used[thing.kind] += 1
    return [thing.name for thing in things], colours


def _draw_curves(
    axis: Axes, published: np.ndarray, ours: np.ndarray, labels: Sequence[str], colours: Sequence[str]
) -> None:
    """Curves [n, T]. The authors count frames from 0 and have no tracks in it, we count from 1."""
    axis.axhline(0.5, color="#7c8695", lw=0.8, ls=(0, (2, 3)))
    for row, (label, colour) in enumerate(zip(labels, colours, strict=True)):
        axis.plot(
            np.arange(1, ours.shape[1] + 1), ours[row], "-", lw=1.4, color=colour, label=label, alpha=0.9
        )
        axis.plot(np.arange(published.shape[1]), published[row], "o", ms=2.6, color=colour, mec="none")
