"""The column beside the map: scenario and defense, frame, metrics, trust in every agent, legend."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import trust_env.render.palette as palette
import trust_env.render.symbols as symbols
from trust_env.render.canvas import Box, Canvas
from trust_env.render.labels import panel_labels
from trust_env.render.palette import BENIGN, INK, MUTED, role_colour, trust_colour
from trust_env.render.scene import Agent, Scene

_TITLE, _TEXT, _SMALL = 26, 17, 15  # pixels, sizes of text
_METRICS = {
    "published_tracks": "tracks in the picture",
    "false_tracks": "false tracks shown",
    "injected_tracks": "of these, injected",
    "missing_targets": "targets missing",
    "visible_targets": "targets in some FOV",
}
_METRIC_ROW, _LEGEND_ROW = 19, 20  # pixels from row to row
_MAX_TRUST_ROW = 24.0
_LEGEND: tuple[tuple[str, Callable[..., None], tuple[Any, ...]], ...] = (
    ("adversary, its FOV", symbols.draw_agent, (True,)),
    ("benign agent, its FOV", symbols.draw_agent, (False,)),
    ("target in the picture", symbols.draw_target, (True, True)),
    ("target missing from it", symbols.draw_target, (True, False)),
    ("target in no FOV", symbols.draw_target, (False, False)),
    ("track, published", symbols.draw_track_symbol, ("published",)),
    ("track, published but false", symbols.draw_track_symbol, ("published", True)),
    ("track, hidden by the defense", symbols.draw_track_symbol, ("hidden",)),
    ("track, tentative", symbols.draw_track_symbol, ("tentative",)),
    ("detection (colour: the agent)", symbols.draw_detection, ("honest", BENIGN)),
    ("clutter", symbols.draw_detection, ("clutter", BENIGN)),
    ("injected detection", symbols.draw_detection, ("injected", BENIGN)),
)


class _Column(NamedTuple):
    """The left and right ends of text and bars, pixels."""

    left: float
    right: float


def draw_panel(canvas: Canvas, box: Box, scene: Scene) -> None:
    """Everything in the box, from top to bottom."""
    x, y, width, height = box
    canvas.rectangle(x, y, width, height, palette.PANEL_BACKGROUND)
    canvas.rectangle(x, y, 1, height, palette.DIVIDER)
    column = _Column(x + 18, x + width - 18)
    legend_top = y + height - 12 - _LEGEND_ROW * len(_LEGEND)
    _draw_head(canvas, column, y, scene)
    _draw_metrics(canvas, column, y + 108, scene)
    _draw_trust(canvas, column, y + 122 + _METRIC_ROW * len(_METRICS), legend_top - 26, scene)
    _draw_legend(canvas, column, legend_top)


def _draw_head(canvas: Canvas, column: _Column, y: float, scene: Scene) -> None:
    """Scenario, defense, frame and time, and how much of the episode is over."""
    left, right = column
    canvas.text(scene.scenario, (left, y + 26), INK, _TITLE)
    canvas.text(f"defense: {scene.defense}", (left, y + 49), MUTED, _TEXT)
    canvas.text(f"frame {scene.frame} of {scene.horizon}", (left, y + 78), INK, _TEXT)
    canvas.text(f"{scene.frame * scene.dt:.5g} s", (right, y + 78), MUTED, _TEXT, right=True)
    canvas.rectangle(left, y + 89, right - left, 5, palette.GRID, 2.5)
    elapsed = min(1.0, scene.frame / scene.horizon)
    if elapsed > 0:
        canvas.rectangle(left, y + 89, max(5.0, elapsed * (right - left)), 5, MUTED, 2.5)


def _draw_metrics(canvas: Canvas, column: _Column, y: float, scene: Scene) -> None:
    for row, (name, label) in enumerate(_METRICS.items()):
        middle = y + 8 + _METRIC_ROW * row
        canvas.text(label, (column.left, middle), MUTED, _SMALL)
        canvas.text(f"{scene.metrics[name]:g}", (column.right, middle), INK, _TEXT, right=True)


def _draw_trust(canvas: Canvas, column: _Column, top: float, bottom: float, scene: Scene) -> None:
    """A bar per agent, with its name and the number where rows are high enough to read them."""
    canvas.text("trust in the agents", (column.left, top + 8), INK, _TEXT)
    top += 24
    row = min(_MAX_TRUST_ROW, (bottom - top) / len(scene.agents))
    size = min(_SMALL, int(row) + 3)
    middles = [top + row * (k + 0.5) for k in range(len(scene.agents))]
    readable = size >= 10
    bars = _draw_names_and_numbers(canvas, column, middles, size, scene) if readable else column
    for agent, middle in zip(scene.agents, middles, strict=True):
        _draw_bar(canvas, bars, middle, 0.42 * row, agent, scene.accuse_below)


def _draw_names_and_numbers(canvas: Canvas, column: _Column, middles: list[float], size: int, scene: Scene) -> _Column:
    """What is left between them, for the bars."""
    labels = panel_labels(scene.agents)
    for agent, label, middle in zip(scene.agents, labels, middles, strict=True):
        canvas.text(label, (column.left, middle), role_colour(agent.adversary), size)
        _draw_number(canvas, column.right, middle, agent, size)
    width = max(canvas.text_width(label, size) for label in labels)
    return _Column(column.left + (width + 10), column.right - 34)


def _draw_number(canvas: Canvas, right: float, middle: float, agent: Agent, size: int) -> None:
    text, colour = ("–", MUTED) if math.isnan(agent.trust) else (f"{agent.trust:.2f}", INK)
    canvas.text(text, (right, middle), colour, size, right=True)


def _draw_bar(canvas: Canvas, bar: _Column, middle: float, height: float, agent: Agent, accuse_below: float) -> None:
    """Trust from 0 to 1, its standard deviation as a whisker; all grey where the defense has no opinion.

    The tick is the trust below which an agent is accused after some frames.
    """
    start, length = bar.left, bar.right - bar.left
    if math.isnan(agent.trust):
        canvas.rectangle(start, middle - height / 2, length, height, palette.NO_OPINION, height / 3)
        return
    colour, filled = trust_colour(agent.trust), max(2.0, agent.trust * length)
    canvas.rectangle(start, middle - height / 2, length, height, palette.GRID, height / 3)
    canvas.rectangle(start, middle - height / 2, filled, height, colour, height / 3)
    low, high = (min(1.0, max(0.0, agent.trust + sign * agent.trust_std)) for sign in (-1, 1))
    canvas.line(np.array([[start + low * length, middle], [start + high * length, middle]]), INK, 1.0)
    tick = start + accuse_below * length
    canvas.line(np.array([[tick, middle - 0.75 * height], [tick, middle + 0.75 * height]]), INK, 0.75)


def _draw_legend(canvas: Canvas, column: _Column, top: float) -> None:
    for row, (label, draw, what) in enumerate(_LEGEND):
        middle = top + _LEGEND_ROW * (row + 0.5)
        draw(canvas, np.array([column.left + 9, middle]), *what)
        canvas.text(label, (column.left + 28, middle), INK, _SMALL)
