"""The figure of the eight trust panels: our curves over the published numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from trust_env.training.paper.coinciding import HINT, draw_lines, turns
from trust_env.training.paper.published import Panel, PanelKey, objects

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AGENT_COLOURS = ("#2563af", "#0f8750", "#b03a2e")
_TARGET_COLOURS, _FALSE_COLOURS = ("#2563af", "#0891b2", "#0f8750", "#6d5ac7"), ("#b03a2e", "#e08214")
_GREY = "#7c8695"


def panel_figure(published: Mapping[PanelKey, Panel], ours: Mapping[PanelKey, Panel], preset: str) -> Figure:
    """Tracks above, agents below; lines are ours, dots the authors' own numbers."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 6.6), layout="constrained")
    axes = figure.subplots(2, len(published), sharex=True, sharey=True, squeeze=False)
    figure.suptitle(f"Trust in the two case studies: lines ours (preset {preset}), dots published", fontweight="bold")
    figure.supxlabel(HINT, fontsize=8, color=_GREY)
    for column, key in enumerate(published):
        axes[0, column].set_title(panel_title(key))
        labels, colours = track_styles(key[0])
        _draw_curves(axes[0, column], published[key].tracks, ours[key].tracks, labels, colours)
        names = [f"agent {k}" for k in range(len(AGENT_COLOURS))]
        _draw_curves(axes[1, column], published[key].agents, ours[key].agents, names, AGENT_COLOURS)
        axes[1, column].set_xlabel("frame")
        axes[0, column].legend(loc="upper center", bbox_to_anchor=(0.5, -0.04), ncols=1, handlelength=1.2)
    axes[0, 0].set(ylabel="trust in the tracks", ylim=(0, 1), xlim=(0, 20.5), xticks=range(0, 21, 5))
    axes[1, 0].set_ylabel("trust in the agents")
    axes[1, -1].legend(loc="lower right", ncols=1, handlelength=1.2)
    return figure


def panel_title(key: PanelKey) -> str:
    """Such as `Case 1, no prior`."""
    case, trusted = key
    return f"Case {case[-1]}, {'strong prior on agent 1' if trusted else 'no prior'}"


def track_styles(case: str) -> tuple[list[str], list[str]]:
    """Names and colours of a case's tracks: reds for false positives."""
    tracked, used = objects(case), {"true": 0, "fp": 0}
    colours = []
    for obj in tracked:
        colours.append((_FALSE_COLOURS if obj.kind == "fp" else _TARGET_COLOURS)[used[obj.kind]])
        used[obj.kind] += 1
    return [obj.name for obj in tracked], colours


def _draw_curves(
    axis: Axes, published: np.ndarray, ours: np.ndarray, labels: Sequence[str], colours: Sequence[str]
) -> None:
    """Curves [n, T]. The authors count frames from 0 and have no tracks in it, we count from 1."""
    axis.axhline(0.5, color=_GREY, lw=0.8, ls=(0, (2, 3)))
    draw_lines(axis, np.arange(1, ours.shape[1] + 1), ours, labels, colours, height=1.0)
    frames = np.arange(published.shape[1])
    for row, turn, colour in zip(published, turns(published, height=1.0), colours, strict=True):
        axis.plot(frames, row, "o", ms=3.2, color=colour, mec="none", markevery=turn.dots)
