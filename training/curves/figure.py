"""A curve as a figure."""

from __future__ import annotations

import importlib.util
import math
from typing import TYPE_CHECKING, Any

from trust_env.metrics import METRICS
from trust_env.training.curves.points import Curve

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = ("#2563af", "#b03a2e", "#ca8a04", "#2e7d5b", "#7b3fa0", "#4b5563", "#0e7490", "#be185d")
_MARKERS = "os^vDPX*"


def has_matplotlib() -> bool:
    return importlib.util.find_spec("matplotlib") is not None


def curve_figure(found: Curve) -> Figure:
    """A panel for every attack, a line for every defense; bars are 95 % intervals of the mean."""
    from matplotlib.figure import Figure

    attacks, defenses = (list(dict.fromkeys(names)) for names in zip(*found.lines, strict=True))
    figure = Figure(figsize=(4.6 * len(attacks), 4.2), layout="constrained")
    axes = figure.subplots(1, len(attacks), sharey=True, squeeze=False)[0]
    positions, labels = _positions(found.values)
    for axis, attack in zip(axes, attacks):
        axis.set_title(attack)
        axis.set_xlabel(f"{found.over}: {found.meaning}", wrap=True)
        axis.set_xticks(positions, labels)
        axis.grid(axis="y", color="#e5e7eb")
        for i, defense in enumerate(defenses):
            summaries = [found.summary(attack, defense, value) for value in found.values]
            rows = [(math.nan,) * 3 if s is None else (s.mean, s.mean_low, s.mean_high) for s in summaries]
            mean, low, high = zip(*rows, strict=True)
            bars = [[m - b for m, b in zip(mean, low)], [t - m for m, t in zip(mean, high)]]
            style = {"color": _COLOURS[i % len(_COLOURS)], "marker": _MARKERS[i % len(_MARKERS)]}
            axis.errorbar(positions, mean, bars, label=defense, capsize=2, ms=5, lw=1.5, **style)
    unit = METRICS[found.metric].unit
    axes[0].set_ylabel(found.metric.replace("_", " ") + ("" if unit == "1" else f" ({unit})"))
    axes[0].set_ylim(bottom=0.0)
    axes[-1].legend()
    return figure


def _positions(values: list[Any]) -> tuple[list[float], list[str]]:
    """Where values stand and what they are called: numbers where they are, or evenly, names evenly."""
    numbers = [v for v in values if isinstance(v, (int, float)) and not isinstance(v, bool)]
    spaced = len(numbers) == len(values) and max(numbers) <= 10 * max(1e-300, min(abs(n) for n in numbers) or 1.0)
    positions = [float(v) for v in values] if spaced else [float(i) for i in range(len(values))]
    return positions, [f"{v:.3g}" if isinstance(v, float) else str(v) for v in values]
