"""The figures of `reproduce` as PNGs: Theorem 1, the cases, and trust beside the published numbers, by preset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from trust_env.files import write_atomically
from trust_env.training.paper.beta_figure import beta_figure
from trust_env.training.paper.layout_figure import layout_figure
from trust_env.training.paper.panel_figure import panel_figure
from trust_env.training.paper.published import Panel, PanelKey
from trust_env.training.paper.surface_figure import surface_figure
from trust_env.training.paper.theorem import TheoremRow
from trust_env.training.paper.theorem_figure import theorem_figure

PRESETS = ("cdc2024", "paper", "mate")
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
        figures = {
            "theorem_1.png": lambda: theorem_figure(rows),
            "theorem_1_surface.png": lambda: surface_figure(rows),
            "layout.png": layout_figure,
        }
        for preset in PRESETS:
            of_preset = panels["published"], panels[preset], preset
            figures[f"trust_{preset}.png"] = partial(panel_figure, *of_preset)
            figures[f"beta_{preset}.png"] = partial(beta_figure, *of_preset)
        for name, draw in figures.items():
            write_atomically(folder / name, draw().savefig)
    return tuple(folder / name for name in figures)
