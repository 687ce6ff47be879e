"""The map: FOVs, agents, targets, detections and tracks of a scene, to scale."""

from __future__ import annotations

import math

import numpy as np

from trust_env.render import marks
from trust_env.render.canvas import Canvas
from trust_env.render.palette import FAINT, GRID, INK, PAPER, Colour, role_colour
from trust_env.render.scene import Agent, Scene

_LABEL = 15  # pixels, height of a name


class View:
    """From metres to pixels: the extent amid a box `x, y, width, height`, at one scale both ways."""

    def __init__(self, extent: tuple[float, float, float, float], box: tuple[float, float, float, float]):
        x0, x1, y0, y1 = extent
        self.box = box
        self.scale = min(box[2] / (x1 - x0), box[3] / (y1 - y0))  # pixels per metre
        self._centre = np.array([x0 + x1, y0 + y1]) / 2
        self._middle = np.array([box[0] + box[2] / 2, box[1] + box[3] / 2])

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """Points [..., 2] in pixels."""
        return self._middle + (points - self._centre) * (self.scale, -self.scale)

    def metres(self, pixels: np.ndarray) -> np.ndarray:
        return self._centre + (pixels - self._middle) / (self.scale, -self.scale)


def draw_ground(canvas: Canvas, view: View, scene: Scene) -> None:
    """What stays the same for an episode: grid, FOVs, agents, scale bar."""
    canvas.rectangle(*view.box, PAPER)
    _draw_grid(canvas, view)
    for agent in scene.agents:
        canvas.tint(view.pixels(agent.outline), role_colour(agent.adversary), 0.05)
    for agent in scene.agents:
        canvas.line(view.pixels(agent.outline), role_colour(agent.adversary), 0.75, closed=True)
    _draw_scale_bar(canvas, view)


def draw_frame(canvas: Canvas, view: View, scene: Scene) -> None:
    """What moves. Truth lies below the tracks, detections above them."""
    canvas.clip(view.box)
    for target in scene.targets:
        marks.draw_target(canvas, view.pixels(target.position), target)
    for track in scene.tracks:
        marks.draw_track(canvas, view, track, 5.0 * scene.dt)
    colours = marks.agent_colours(scene)
    for detection in scene.detections:
        marks.draw_detection(
            canvas, view.pixels(detection.position), detection.kind, colours[detection.agent]
        )
    _draw_agents(canvas, view, scene.agents)
    canvas.clip(None)


def _draw_agents(canvas: Canvas, view: View, agents: list[Agent]) -> None:
    taken: list[tuple[float, float, float]] = []
    for k, agent in enumerate(agents):
        at = view.pixels(agent.position)
        marks.draw_agent(canvas, at, agent.adversary)
        name = agent.name if len(agents) <= marks.NAMED else str(k)
        _draw_label(canvas, view, at, name, role_colour(agent.adversary), taken)


def _draw_label(
    canvas: Canvas,
    view: View,
    at: np.ndarray,
    name: str,
    colour: Colour,
    taken: list[tuple[float, float, float]],
) -> None:
    """A name beside its agent, below the names that are already there."""
    width = canvas.text_width(name, _LABEL)
    x = min(at[0] + 9, view.box[0] + view.box[2] - width - 4)
    y = at[1]
    while any(abs(y - other_y) < 12 and x < right and left < x + width for left, right, other_y in taken):
        y += 12
    taken.append((x, x + width, y))
    canvas.text(name, (x, y), colour, _LABEL, halo=PAPER)


def _draw_grid(canvas: Canvas, view: View) -> None:
    x, y, width, height = view.box
    step = _round_length(width / view.scale / 8)
    corners = view.metres(np.array([[x, y + height], [x + width, y]]))
    for axis in (0, 1):
        low, high = corners[0, axis], corners[1, axis]
        for value in np.arange(math.ceil(low / step), math.floor(high / step) + 1) * step:
            ends = corners.copy()
            ends[:, axis] = value
            canvas.line(view.pixels(ends), GRID, 0.5)


def _draw_scale_bar(canvas: Canvas, view: View) -> None:
    x, y, width, height = view.box
    length = _round_length(width / view.scale / 5)
    left, right, base = x + 16, x + 16 + length * view.scale, y + height - 16
    canvas.line(np.array([[left, base - 4], [left, base], [right, base], [right, base - 4]]), INK, 1.5)
    canvas.text(_length_text(length), (left + 3, base - 10), FAINT, _LABEL)


def _round_length(most: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not above `most`."""
    power = 10.0 ** math.floor(math.log10(most))
    return max(step for step in (1.0, 2.0, 5.0) if step * power <= most * (1 + 1e-9)) * power


def _length_text(metres: float) -> str:
    return f"{metres / 1000:g} km" if metres >= 1000 else f"{metres:g} m"
