"""The map: FOVs, agents, targets, detections and tracks of a scene, to scale."""

from __future__ import annotations

import math

import numpy as np

import trust_env.render.symbols as symbols
from trust_env.render.camera import Camera
from trust_env.render.canvas import Canvas
from trust_env.render.labels import detection_colours, map_labels
from trust_env.render.palette import BACKGROUND, GRID, INK, MUTED, role_colour
from trust_env.render.scene import Agent, Scene

_TEXT_SIZE = 15  # pixels
_Interval = tuple[float, float, float]  # x from, x to, y of a label, pixels


def draw_background(canvas: Canvas, camera: Camera, scene: Scene) -> None:
    """What stays the same for an episode: grid, FOVs, scale bar."""
    canvas.rectangle(*camera.box, BACKGROUND)
    _draw_grid(canvas, camera)
    for agent in scene.agents:
        canvas.tint(camera.pixels(agent.outline), role_colour(agent.adversary), 0.05)
    for agent in scene.agents:
        canvas.line(camera.pixels(agent.outline), role_colour(agent.adversary), 0.75, closed=True)
    _draw_scale_bar(canvas, camera)


def draw_frame(canvas: Canvas, camera: Camera, scene: Scene) -> None:
    """What changes every frame: targets lie below the tracks, detections and agents above them."""
    canvas.clip(camera.box)
    for target in scene.targets:
        symbols.draw_target(canvas, camera.pixels(target.position), target.visible, target.shown)
    for track in scene.tracks:
        symbols.draw_track(canvas, camera, track, 5.0 * scene.dt)
    colours = detection_colours(scene.agents)
    for detection in scene.detections:
        at = camera.pixels(detection.position)
        symbols.draw_detection(canvas, at, detection.kind, colours[detection.agent])
    _draw_agents(canvas, camera, scene.agents)
    canvas.clip(None)


def _draw_agents(canvas: Canvas, camera: Camera, agents: list[Agent]) -> None:
    """Each agent with its label, which is moved down until it overlaps no earlier one."""
    placed: list[_Interval] = []
    for agent, label in zip(agents, map_labels(agents), strict=True):
        at = camera.pixels(agent.position)
        symbols.draw_agent(canvas, at, agent.adversary)
        width = canvas.text_width(label, _TEXT_SIZE)
        x, y = _place_label(camera, at, width, placed)
        placed.append((x, x + width, y))
        canvas.text(label, (x, y), role_colour(agent.adversary), _TEXT_SIZE, halo=BACKGROUND)


def _place_label(camera: Camera, at: np.ndarray, width: float, placed: list[_Interval]) -> tuple[float, float]:
    """Where a label of this width stands: x of its left end, y of its middle, pixels."""
    x = min(at[0] + 9, camera.box[0] + camera.box[2] - width - 4)
    y = at[1]
    while any(abs(y - other_y) < 12 and x < right and left < x + width for left, right, other_y in placed):
        y += 12
    return x, y


def _draw_grid(canvas: Canvas, camera: Camera) -> None:
    """Lines at multiples of a round length, about eight across the map."""
    x, y, width, height = camera.box
    step = _round_length(width / camera.scale / 8)
    corners = camera.metres(np.array([[x, y + height], [x + width, y]]))
    for axis in (0, 1):
        low, high = corners[0, axis], corners[1, axis]
        for value in np.arange(math.ceil(low / step), math.floor(high / step) + 1) * step:
            ends = corners.copy()
            ends[:, axis] = value
            canvas.line(camera.pixels(ends), GRID, 0.5)


def _draw_scale_bar(canvas: Canvas, camera: Camera) -> None:
    """A bar of a round length, about a fifth of the map, with the length written above it."""
    x, y, width, height = camera.box
    length = _round_length(width / camera.scale / 5)
    left, right, base = x + 16, x + 16 + length * camera.scale, y + height - 16
    canvas.line(np.array([[left, base - 4], [left, base], [right, base], [right, base - 4]]), INK, 1.5)
    canvas.text(_format_length(length), (left + 3, base - 10), MUTED, _TEXT_SIZE)


def _round_length(limit: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not above `limit`."""
    power = 10.0 ** math.floor(math.log10(limit))
    return max(step for step in (1.0, 2.0, 5.0) if step * power <= limit * (1 + 1e-9)) * power


def _format_length(metres: float) -> str:
    return f"{metres / 1000:g} km" if metres >= 1000 else f"{metres:g} m"
