"""The column beside the map: what runs, the frame, its metrics, the trust in every agent, the legend."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from trust_env.render import marks
from trust_env.render.canvas import Canvas
from trust_env.render.palette import (
    BENIGN,
    FAINT,
    GRID,
    INK,
    NO_OPINION,
    PANEL,
    RULE,
    Colour,
    role_colour,
    trust_colour,
)
from trust_env.render.scene import Agent, Scene, Target

_TITLE, _TEXT, _SMALL = 26, 17, 15  # pixels, heights of text
_METRICS = {
    "published_tracks": "tracks in the picture",
    "false_tracks": "false tracks shown",
    "injected_tracks": "of these, injected",
    "missing_targets": "targets missing",
    "visible_targets": "targets in some FOV",
}
_LEGEND_ROW = 20
_Sign = Callable[[Canvas, np.ndarray], None]
_LEGEND: tuple[tuple[str, _Sign], ...] = (
    ("adversary, its FOV", lambda canvas, at: marks.draw_agent(canvas, at, True)),
    ("benign agent, its FOV", lambda canvas, at: marks.draw_agent(canvas, at, False)),
    ("target in the picture", lambda canvas, at: marks.draw_target(canvas, at, Target(at, True, True))),
    ("target missing from it", lambda canvas, at: marks.draw_target(canvas, at, Target(at, True, False))),
    ("target in no FOV", lambda canvas, at: marks.draw_target(canvas, at, Target(at, False, False))),
    ("track, published", lambda canvas, at: marks.draw_track_sign(canvas, at, "published")),
    ("track, published but false", lambda canvas, at: marks.draw_track_sign(canvas, at, "published", True)),
    ("track, hidden by the defense", lambda canvas, at: marks.draw_track_sign(canvas, at, "hidden")),
    ("track, tentative", lambda canvas, at: marks.draw_track_sign(canvas, at, "tentative")),
    ("detection (colour: the agent)", lambda canvas, at: marks.draw_detection(canvas, at, "honest", BENIGN)),
    ("clutter", lambda canvas, at: marks.draw_detection(canvas, at, "clutter", BENIGN)),
    ("injected detection", lambda canvas, at: marks.draw_detection(canvas, at, "injected", BENIGN)),
)


def draw_panel(canvas: Canvas, box: tuple[float, float, float, float], scene: Scene) -> None:
    """Everything in the column `x, y, width, height`."""
    x, y, width, height = box
    canvas.rectangle(x, y, width, height, PANEL)
    canvas.rectangle(x, y, 1, height, RULE)
    left, right = x + 18, x + width - 18
    y = _draw_head(canvas, left, right, y, scene)
    y = _draw_metrics(canvas, left, right, y, scene)
    legend = box[1] + height - 12 - _LEGEND_ROW * len(_LEGEND)
    _draw_trust(canvas, left, right, y, legend - 26, scene)
    _draw_legend(canvas, left, legend)


def _draw_head(canvas: Canvas, left: float, right: float, y: float, scene: Scene) -> float:
    canvas.text(scene.scenario, (left, y + 26), INK, _TITLE)
    canvas.text(f"defense: {scene.defense}", (left, y + 49), FAINT, _TEXT)
    canvas.text(f"frame {scene.frame} of {scene.horizon}", (left, y + 78), INK, _TEXT)
    canvas.text(f"{scene.frame * scene.dt:.5g} s", (right, y + 78), FAINT, _TEXT, right=True)
    canvas.rectangle(left, y + 89, right - left, 5, GRID, 2.5)
    share = min(1.0, scene.frame / scene.horizon)
    if share > 0:
        canvas.rectangle(left, y + 89, max(5.0, share * (right - left)), 5, FAINT, 2.5)
    return y + 108


def _draw_metrics(canvas: Canvas, left: float, right: float, y: float, scene: Scene) -> float:
    for row, (name, label) in enumerate(_METRICS.items()):
        canvas.text(label, (left, y + 8 + 19 * row), FAINT, _SMALL)
        canvas.text(f"{scene.metrics[name]:g}", (right, y + 8 + 19 * row), INK, _TEXT, right=True)
    return y + 19 * len(_METRICS) + 14


def _draw_trust(canvas: Canvas, left: float, right: float, top: float, bottom: float, scene: Scene) -> None:
    """A bar per agent; the tick is the trust below which an agent counts as accused."""
    canvas.text("trust in the agents", (left, top + 8), INK, _TEXT)
    top += 24
    row = min(24.0, (bottom - top) / len(scene.agents))
    size = min(_SMALL, int(row) + 3)
    names = size >= 10
    labels = marks.agent_labels(scene.agents)
    start = left + (max(canvas.text_width(label, size) for label in labels) + 10 if names else 0)
    end = right - 34 if names else right
    for k, agent in enumerate(scene.agents):
        middle = top + row * (k + 0.5)
        if names:
            canvas.text(labels[k], (left, middle), role_colour(agent.adversary), size)
            _draw_value(canvas, right, middle, agent, size)
        _draw_bar(canvas, (start, end), middle, 0.42 * row, agent, scene.accuse_below)


def _draw_value(canvas: Canvas, right: float, middle: float, agent: Agent, size: int) -> None:
    text = "–" if math.isnan(agent.trust) else f"{agent.trust:.2f}"
    canvas.text(text, (right, middle), FAINT if math.isnan(agent.trust) else INK, size, right=True)


def _draw_bar(
    canvas: Canvas, ends: tuple[float, float], middle: float, height: float, agent: Agent, accused: float
) -> None:
    """From 0 to 1, with the standard deviation as a whisker; grey all along when there is no opinion."""
    start, length = ends[0], ends[1] - ends[0]
    unknown = math.isnan(agent.trust)
    canvas.rectangle(start, middle - height / 2, length, height, NO_OPINION if unknown else GRID, height / 3)
    if unknown:
        return
    colour: Colour = trust_colour(agent.trust)
    canvas.rectangle(start, middle - height / 2, max(2.0, agent.trust * length), height, colour, height / 3)
    low, high = (min(1.0, max(0.0, agent.trust + s * agent.deviation)) for s in (-1, 1))
    canvas.line(np.array([[start + low * length, middle], [start + high * length, middle]]), INK, 1.0)
    tick = start + accused * length
    canvas.line(np.array([[tick, middle - 0.75 * height], [tick, middle + 0.75 * height]]), INK, 0.75)


def _draw_legend(canvas: Canvas, left: float, top: float) -> None:
    for row, (label, sign) in enumerate(_LEGEND):
        middle = top + _LEGEND_ROW * (row + 0.5)
        sign(canvas, np.array([left + 9, middle]))
        canvas.text(label, (left + 28, middle), INK, _SMALL)
