"""One sign for everything on the map; the legend draws the same ones."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trust_env.render.canvas import Canvas
from trust_env.render.palette import (
    COVERED,
    FAINT,
    HIDDEN,
    INJECTED,
    INK,
    MISSING,
    PAPER,
    PUBLISHED,
    TENTATIVE,
    Colour,
    agent_colour,
    role_colour,
)
from trust_env.render.scene import Agent, DetectionKind, Scene, Target, Track, TrackKind

if TYPE_CHECKING:
    from trust_env.render.plan import View

_TRACK_COLOURS: dict[TrackKind, Colour] = {
    "published": PUBLISHED,
    "hidden": HIDDEN,
    "tentative": TENTATIVE,
}
NAMED = 8  # with more agents than this, names would hide the map: indices stand for them
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)  # [48, 2]
_DIAMOND = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
_TRIANGLE = np.array([[0.0, -1.1], [1.0, 0.75], [-1.0, 0.75]])


def agent_colours(scene: Scene) -> list[Colour]:
    """Of every agent's detections."""
    roles = [agent.adversary for agent in scene.agents]
    return [agent_colour(role, roles[:k].count(role), roles.count(role)) for k, role in enumerate(roles)]


def agent_labels(agents: list[Agent]) -> list[str]:
    """What to write beside the bars: in a crowd the index, which stands on the map, and the name."""
    if len(agents) <= NAMED:
        return [agent.name for agent in agents]
    return [f"{k}  {agent.name}" for k, agent in enumerate(agents)]


def draw_agent(canvas: Canvas, at: np.ndarray, adversary: bool) -> None:
    """A triangle for an adversary, a square for a benign agent."""
    if adversary:
        canvas.polygon(at + 6.0 * _TRIANGLE, role_colour(True))
    else:
        canvas.rectangle(at[0] - 4.5, at[1] - 4.5, 9, 9, role_colour(False), 1.5)


def draw_target(canvas: Canvas, at: np.ndarray, target: Target) -> None:
    """A diamond: grey when the picture shows the target, yellow when not, hollow where no FOV holds it."""
    canvas.polygon(at + 6.0 * _DIAMOND, INK if target.visible or target.shown else FAINT)
    inside = COVERED if target.shown else MISSING if target.visible else PAPER
    canvas.polygon(at + 4.6 * _DIAMOND, inside)


def draw_detection(canvas: Canvas, at: np.ndarray, kind: DetectionKind, colour: Colour) -> None:
    """A dot in the agent's colour; clutter hollow; an injection a magenta x."""
    if kind == "injected":
        canvas.cross(at, 4.5, INJECTED, 2.0)
    elif kind == "clutter":
        canvas.ring(at, 3.0, colour, 1.0)
    else:
        canvas.disc(at, 2.5, colour)


def ellipse(mean: np.ndarray, cov: np.ndarray, sigmas: float = 2.0) -> np.ndarray:
    """Corners [48, 2] of the covariance ellipse."""
    values, axes = np.linalg.eigh(cov)
    return mean + sigmas * (_CIRCLE * np.sqrt(np.maximum(values, 0.0))) @ axes.T


def track_colour(kind: TrackKind, false: bool) -> Colour:
    return INJECTED if false else _TRACK_COLOURS[kind]


def draw_track(canvas: Canvas, view: View, track: Track, seconds: float) -> None:
    """The ellipse to scale, the sign of its status, and the way it will have gone in so many seconds."""
    colour, at = track_colour(track.kind, track.false), view.pixels(track.position)
    outline = view.pixels(ellipse(track.position, track.cov))
    if np.ptp(outline, axis=0).max() > 3.0:
        if track.kind == "published":
            canvas.tint(outline, colour, 0.16)
        canvas.line(outline, colour, 1.0, closed=True)
    ahead = view.pixels(track.position + seconds * track.velocity)
    if np.hypot(*(ahead - at)) > 2.0:
        canvas.line(np.array([at, ahead]), colour, 1.0)
    draw_track_sign(canvas, at, track.kind, track.false)


def draw_track_sign(canvas: Canvas, at: np.ndarray, kind: TrackKind, false: bool = False) -> None:
    """A ring of fixed size: whole when published, dashed when hidden, small when tentative."""
    colour = track_colour(kind, false)
    if kind == "published":
        canvas.ring(at, 9.0, colour, 2.0)
    elif kind == "hidden":
        canvas.dashes(at + 9.0 * _CIRCLE, colour, 2.0)
    else:
        canvas.ring(at, 6.0, colour, 1.0)
