"""Shapes and text with smooth edges: drawn at twice the size, scaled down at the end. Needs no window."""

from __future__ import annotations

import itertools
from collections.abc import Iterable

import numpy as np
import pygame

from trust_env.render.palette import Colour

Box = tuple[float, float, float, float]  # x, y, width, height, pixels

_OVERSAMPLING = 2  # drawn pixels per pixel of the result, along each axis
_DASH = 4.0  # pixels, of a dash and of the gap after it
_FONTS: dict[int, pygame.font.Font] = {}  # by height in drawn pixels


def _font(size: int) -> pygame.font.Font:
    """pygame's own font, the same on every machine; loaded again after a `pygame.quit()`."""
    pygame.font.init()
    try:
        _FONTS[size].get_height()
    except (KeyError, pygame.error):
        _FONTS[size] = pygame.font.Font(None, size)
    return _FONTS[size]


class Canvas:
    """An image of `size` pixels; all positions and lengths are in pixels, y downwards."""

    def __init__(self, size: tuple[int, int], background: Colour):
        self.size = size
        self.surface = pygame.Surface((size[0] * _OVERSAMPLING, size[1] * _OVERSAMPLING))
        self.surface.fill(background)

    def copy(self) -> Canvas:
        other = object.__new__(Canvas)
        other.size, other.surface = self.size, self.surface.copy()
        return other

    def clip(self, box: Box | None) -> None:
        """Draw only inside the box from now on; None: everywhere."""
        self.surface.set_clip(None if box is None else [round(v * _OVERSAMPLING) for v in box])

    def to_surface(self) -> pygame.Surface:
        """What has been drawn, in `size` pixels."""
        return pygame.transform.smoothscale(self.surface, self.size)

    def rectangle(self, x: float, y: float, width: float, height: float, colour: Colour, radius: float = 0) -> None:
        box = pygame.Rect(*(round(v * _OVERSAMPLING) for v in (x, y, width, height)))
        pygame.draw.rect(self.surface, colour, box, border_radius=round(radius * _OVERSAMPLING))

    def tint(self, points: np.ndarray, colour: Colour, opacity: float) -> None:
        """Fill a polygon [n, 2] with a translucent colour."""
        corners = np.asarray(points) * _OVERSAMPLING
        low = np.floor(corners.min(axis=0)).astype(int)
        size = np.ceil(corners.max(axis=0)).astype(int) - low + 1
        layer = pygame.Surface(size.tolist(), pygame.SRCALPHA)
        pygame.draw.polygon(layer, (*colour, round(255 * opacity)), corners - low)
        self.surface.blit(layer, low.tolist())

    def polygon(self, points: np.ndarray, colour: Colour) -> None:
        pygame.draw.polygon(self.surface, colour, np.asarray(points) * _OVERSAMPLING)

    def line(self, points: np.ndarray, colour: Colour, width: float = 1.0, closed: bool = False) -> None:
        """A line through points [n, 2]."""
        drawn_width = max(1, round(width * _OVERSAMPLING))
        pygame.draw.lines(self.surface, colour, closed, np.asarray(points) * _OVERSAMPLING, drawn_width)

    def dashes(self, points: np.ndarray, colour: Colour, width: float = 1.0) -> None:
        """A dashed outline of the polygon [n, 2]."""
        ring = np.concatenate([points, points[:1]])
        arc_length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ring, axis=0).T))])
        count = max(3, round(arc_length[-1] / (2 * _DASH)))
        for start in arc_length[-1] * np.arange(count) / count:
            along = np.linspace(start, start + arc_length[-1] / (2 * count), 4)
            corners = [np.interp(along, arc_length, ring[:, axis]) for axis in (0, 1)]
            self.line(np.stack(corners, axis=1), colour, width)

    def disc(self, at: Iterable[float], radius: float, colour: Colour) -> None:
        pygame.draw.circle(self.surface, colour, np.asarray(at) * _OVERSAMPLING, radius * _OVERSAMPLING)

    def ring(self, at: Iterable[float], radius: float, colour: Colour, width: float = 1.0) -> None:
        centre, drawn_width = np.asarray(at) * _OVERSAMPLING, max(1, round(width * _OVERSAMPLING))
        pygame.draw.circle(self.surface, colour, centre, radius * _OVERSAMPLING, drawn_width)

    def cross(self, at: np.ndarray, arm: float, colour: Colour, width: float = 1.0) -> None:
        """An x; `arm`: half its width."""
        for diagonal in (np.array([1.0, 1.0]), np.array([1.0, -1.0])):
            self.line(np.array([at - arm * diagonal, at + arm * diagonal]), colour, width)

    def text(
        self,
        text: str,
        at: tuple[float, float],
        colour: Colour,
        size: int = 16,
        right: bool = False,
        halo: Colour | None = None,
    ) -> None:
        """Text from `at`, or with `right` up to it, at half its height; halo: a colour around the letters."""
        font = _font(size * _OVERSAMPLING)
        width, height = font.size(text)
        x = round(at[0] * _OVERSAMPLING - (width if right else 0))
        y = round(at[1] * _OVERSAMPLING - height / 2)
        if halo is not None:
            outline = font.render(text, True, halo)
            for dx, dy in itertools.product((-3, 0, 3), repeat=2):
                self.surface.blit(outline, (x + dx, y + dy))
        self.surface.blit(font.render(text, True, colour), (x, y))

    def text_width(self, text: str, size: int) -> float:
        """Pixels."""
        return _font(size * _OVERSAMPLING).size(text)[0] / _OVERSAMPLING
