"""Curves that coincide, drawn so that each of them shows: their dashes and dots take turns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NEAR = 0.012  # of the axis's height: nearer than this lines cover one another
HINT = "where curves coincide, their colours take turns"
_DASH = 7.0  # in line widths


class Turn(NamedTuple):
    """A curve's place among the `of` curves that coincide with it, itself among them."""

    number: int
    of: int

    @property
    def line_style(self) -> str | tuple[float, tuple[float, float]]:
        """Solid where it is alone, else dashes in the gaps of the others."""
        return "-" if self.of == 1 else (-self.number * _DASH, (_DASH, (self.of - 1) * _DASH))

    @property
    def dots(self) -> tuple[int, int]:
        """Which of its points are marked: the first, and every how many."""
        return self.number, self.of


def turns(curves: np.ndarray, height: float) -> list[Turn]:
    """The turn of every curve of [n, T] on an axis of some height; NaN: a curve is not there.

    Curves belong together where each is everywhere near the first of them.
    """
    first = [next(i for i in range(len(curves)) if _near(curves[i], curve, height)) for curve in curves]
    return [Turn(first[:n].count(leader), first.count(leader)) for n, leader in enumerate(first)]


def _near(one: np.ndarray, other: np.ndarray, height: float) -> bool:
    """Whether two curves cover one another wherever the axis shows both."""
    apart = np.abs(np.clip(one, 0.0, height) - np.clip(other, 0.0, height))
    return not np.isnan(apart).all() and bool(np.nanmax(apart) < NEAR * height)


def draw_lines(
    axis: Axes, x: np.ndarray, curves: np.ndarray, labels: Sequence[str], colours: Sequence[str], height: float
) -> None:
    """A line for every curve of [n, T]; in the legend all are solid."""
    for curve, turn, label, colour in zip(curves, turns(curves, height), labels, colours, strict=True):
        axis.plot([], [], "-", lw=1.6, color=colour, label=label)
        axis.plot(x, curve, ls=turn.line_style, lw=1.6, color=colour, dash_capstyle="butt")
