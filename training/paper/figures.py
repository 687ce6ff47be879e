"""The figures of `reproduce` as PNGs: Theorem 1, and the eight trust panels over the published curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from trust_env.files import write_atomically
from trust_env.training.paper.panel_figure import panel_figure
from trust_env.training.paper.published import Panel, PanelKey
from trust_env.training.paper.theorem import TheoremRow
from trust_env.training.paper.theorem_figure import theorem_figure

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
            write_atomically(folder / name, figure.savefig)
    return tuple(folder / name for name in figures)
