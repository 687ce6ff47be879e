"""The symbol of each agent, target, detection and track; the map and the legend draw the same ones."""

from __future__ import annotations

import numpy as np

import trust_env.render.palette as palette
from trust_env.render.camera import Camera
from trust_env.render.canvas import Canvas
from trust_env.render.palette import Colour, role_colour
from trust_env.render.scene import DetectionKind, Track, TrackKind

_TRACK_COLOURS: dict[TrackKind, Colour] = {
    "published": palette.PUBLISHED,
    "hidden": palette.HIDDEN,
    "tentative": palette.TENTATIVE,
}
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)  # [48, 2]
_DIAMOND = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
_TRIANGLE = np.array([[0.0, -1.1], [1.0, 0.75], [-1.0, 0.75]])


def draw_agent(canvas: Canvas, at: np.ndarray, adversary: bool) -> None:
    """A triangle for an adversary, a square for a benign agent."""
    if adversary:
        canvas.polygon(at + 6.0 * _TRIANGLE, role_colour(True))
    else:
        canvas.rectangle(at[0] - 4.5, at[1] - 4.5, 9, 9, role_colour(False), 1.5)


def draw_target(canvas: Canvas, at: np.ndarray, visible: bool, shown: bool) -> None:
    """A diamond: grey when it is in the picture, yellow when missing, hollow when in no FOV."""
    edge = palette.INK if visible or shown else palette.MUTED
    inside = palette.MISSING if visible else palette.BACKGROUND
    canvas.polygon(at + 6.0 * _DIAMOND, edge)
    canvas.polygon(at + 4.6 * _DIAMOND, palette.IN_PICTURE if shown else inside)


def draw_detection(canvas: Canvas, at: np.ndarray, kind: DetectionKind, colour: Colour) -> None:
    """A dot in the agent's colour; a ring for clutter; a magenta x for an injection."""
    if kind == "injected":
        canvas.cross(at, 4.5, palette.INJECTED, 2.0)
    elif kind == "clutter":
        canvas.ring(at, 3.0, colour, 1.0)
    else:
        canvas.disc(at, 2.5, colour)


def draw_track(canvas: Canvas, camera: Camera, track: Track, seconds: float) -> None:
    """The 2-sigma ellipse and the displacement within `seconds`, both to scale, and the track's symbol."""
    colour, at = _track_colour(track.kind, track.false), camera.pixels(track.position)
    outline = camera.pixels(_ellipse(track.position, track.cov))
    if np.ptp(outline, axis=0).max() > 3.0:
        if track.kind == "published":
            canvas.tint(outline, colour, 0.16)
        canvas.line(outline, colour, 1.0, closed=True)
    ahead = camera.pixels(track.position + seconds * track.velocity)
    if np.hypot(*(ahead - at)) > 2.0:
        canvas.line(np.array([at, ahead]), colour, 1.0)
    draw_track_symbol(canvas, at, track.kind, track.false)


def draw_track_symbol(canvas: Canvas, at: np.ndarray, kind: TrackKind, false: bool = False) -> None:
    """A ring of fixed size: solid when published, dashed when hidden, small when tentative."""
    colour = _track_colour(kind, false)
    if kind == "published":
        canvas.ring(at, 9.0, colour, 2.0)
    elif kind == "hidden":
        canvas.dashes(at + 9.0 * _CIRCLE, colour, 2.0)
    else:
        canvas.ring(at, 6.0, colour, 1.0)


def _track_colour(kind: TrackKind, false: bool) -> Colour:
    return palette.INJECTED if false else _TRACK_COLOURS[kind]


def _ellipse(mean: np.ndarray, cov: np.ndarray, sigmas: float = 2.0) -> np.ndarray:
    """Corners [48, 2] of the covariance ellipse."""
    values, axes = np.linalg.eigh(cov)
    return mean + sigmas * (_CIRCLE * np.sqrt(np.maximum(values, 0.0))) @ axes.T
