"""The figure of the final beliefs: the Beta densities of tracks and agents after the last frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from trust_env.training.paper.coinciding import HINT, draw_lines
from trust_env.training.paper.panel_figure import AGENT_COLOURS, panel_title, track_styles
from trust_env.training.paper.published import N_AGENTS, Panel, PanelKey

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_TRUST = np.linspace(0.002, 0.998, 499)
_MOST = 8.0  # of a density; what is narrower is cut off


def beta_figure(published: Mapping[PanelKey, Panel], ours: Mapping[PanelKey, Panel], preset: str) -> Figure:
    """Tracks above, agents below; lines are ours, dotted the authors' own."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 6.6), layout="constrained")
    axes = figure.subplots(2, len(published), sharex=True, sharey=True, squeeze=False)
    figure.suptitle(
        f"Beta densities of trust after 20 frames: lines ours (preset {preset}), dotted published", fontweight="bold"
    )
    figure.supxlabel(HINT, fontsize=8, color="#7c8695")
    for column, key in enumerate(published):
        axes[0, column].set_title(panel_title(key))
        labels, colours = track_styles(key[0])
        theirs, own = published[key].beliefs, ours[key].beliefs
        _draw_densities(axes[0, column], theirs[:-N_AGENTS], own[:-N_AGENTS], labels, colours)
        names = [f"agent {k}" for k in range(N_AGENTS)]
        _draw_densities(axes[1, column], theirs[-N_AGENTS:], own[-N_AGENTS:], names, AGENT_COLOURS)
        axes[1, column].set_xlabel("trust")
        axes[0, column].legend(loc="upper center", bbox_to_anchor=(0.5, -0.04), ncols=1, handlelength=1.2)
    axes[0, 0].set(ylabel="density, tracks", xlim=(0, 1), ylim=(0, _MOST))
    axes[1, 0].set_ylabel("density, agents")
    axes[1, -1].legend(loc="upper left", ncols=1, handlelength=1.2)
    return figure


def _draw_densities(
    axis: Axes, published: np.ndarray, ours: np.ndarray, labels: Sequence[str], colours: Sequence[str]
) -> None:
    """Densities of beliefs [n, 2] (α, β)."""
    from matplotlib.colors import to_rgb

    draw_lines(axis, _TRUST, np.array([beta_density(*own) for own in ours]), labels, colours, _MOST)
    for theirs, colour in zip(published, colours, strict=True):
        darker = [0.45 * part for part in to_rgb(colour)]  # so that it shows on our line
        axis.plot(_TRUST, beta_density(*theirs), ls=(0, (1, 3)), lw=1.4, color=darker)


def beta_density(alpha: float, beta: float) -> np.ndarray:
    """The density of Beta(α, β) over the figure's axis."""
    from scipy.stats import beta as distribution

    return distribution.pdf(_TRUST, alpha, beta)
