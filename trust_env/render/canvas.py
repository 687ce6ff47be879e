"""Drawing with smooth edges: all is drawn at twice the size and shrunk at the end. Needs no window."""

from __future__ import annotations

import itertools
from collections.abc import Iterable

import numpy as np
import pygame

from trust_env.render.palette import Colour

_FINE = 2  # drawn pixels per pixel of the result
_DASH = 4.0  # pixels, of a dash and of the gap after it


_FONTS: dict[int, pygame.font.Font] = {}


def _font(size: int) -> pygame.font.Font:
    """pygame's own font, the same on every machine; made anew where somebody has quit pygame in between."""
    pygame.font.init()
    try:
        _FONTS[size].get_height()
    except (KeyError, pygame.error):
        _FONTS[size] = pygame.font.Font(None, size)
    return _FONTS[size]


class Canvas:
    """A picture of `size` pixels; all positions and lengths are in pixels, y downwards."""

    def __init__(self, size: tuple[int, int], background: Colour):
        self.size = size
        self.surface = pygame.Surface((size[0] * _FINE, size[1] * _FINE))
        self.surface.fill(background)

    def copy(self) -> Canvas:
        other = object.__new__(Canvas)
        other.size, other.surface = self.size, self.surface.copy()
        return other

    def clip(self, box: tuple[float, float, float, float] | None) -> None:
        """Draw only inside x, y, width, height from now on; None: everywhere."""
        self.surface.set_clip(None if box is None else [round(v * _FINE) for v in box])

    def to_surface(self) -> pygame.Surface:
        return pygame.transform.smoothscale(self.surface, self.size)

    def rectangle(
        self, x: float, y: float, width: float, height: float, colour: Colour, radius: float = 0
    ) -> None:
        box = pygame.Rect(*(round(v * _FINE) for v in (x, y, width, height)))
        pygame.draw.rect(self.surface, colour, box, border_radius=round(radius * _FINE))

    def tint(self, points: np.ndarray, colour: Colour, opacity: float) -> None:
        """Fill a polygon [n, 2] with a see-through colour."""
        corners = np.asarray(points) * _FINE
        low = np.floor(corners.min(axis=0)).astype(int)
        size = np.ceil(corners.max(axis=0)).astype(int) - low + 1
        layer = pygame.Surface(size.tolist(), pygame.SRCALPHA)
        pygame.draw.polygon(layer, (*colour, round(255 * opacity)), corners - low)
        self.surface.blit(layer, low.tolist())

    def polygon(self, points: np.ndarray, colour: Colour) -> None:
        pygame.draw.polygon(self.surface, colour, np.asarray(points) * _FINE)

    def line(self, points: np.ndarray, colour: Colour, width: float = 1.0, closed: bool = False) -> None:
        """Through points [n, 2]."""
        pygame.draw.lines(
            self.surface, colour, closed, np.asarray(points) * _FINE, max(1, round(width * _FINE))
        )

    def dashes(self, points: np.ndarray, colour: Colour, width: float = 1.0) -> None:
        """A dashed line around the corners [n, 2]."""
        ring = np.concatenate([points, points[:1]])
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ring, axis=0).T))])
        count = max(3, round(along[-1] / (2 * _DASH)))
        for start in along[-1] * np.arange(count) / count:
            at = np.linspace(start, start + along[-1] / (2 * count), 4)
            self.line(np.stack([np.interp(at, along, ring[:, i]) for i in (0, 1)], axis=1), colour, width)

    def disc(self, at: Iterable[float], radius: float, colour: Colour) -> None:
        pygame.draw.circle(self.surface, colour, np.asarray(at) * _FINE, radius * _FINE)

    def ring(self, at: Iterable[float], radius: float, colour: Colour, width: float = 1.0) -> None:
        pygame.draw.circle(
            self.surface, colour, np.asarray(at) * _FINE, radius * _FINE, max(1, round(width * _FINE))
        )

    def cross(self, at: np.ndarray, arm: float, colour: Colour, width: float = 1.0) -> None:
        """An x; `arm`: half its width."""
        for way in ((1.0, 1.0), (1.0, -1.0)):
            self.line(np.array([at - arm * np.array(way), at + arm * np.array(way)]), colour, width)

    def text(
        self,
        text: str,
        at: tuple[float, float],
        colour: Colour,
        size: int = 16,
        right: bool = False,
        halo: Colour | None = None,
    ) -> None:
        """From, or up to, `at`, the middle of its left or right end. halo: a colour around the letters."""
        width, height = _font(size * _FINE).size(text)
        corner = (round(at[0] * _FINE - (width if right else 0)), round(at[1] * _FINE - height / 2))
        if halo is not None:
            around = _font(size * _FINE).render(text, True, halo)
            for dx, dy in itertools.product((-3, 0, 3), repeat=2):
                self.surface.blit(around, (corner[0] + dx, corner[1] + dy))
        self.surface.blit(_font(size * _FINE).render(text, True, colour), corner)

    def text_width(self, text: str, size: int) -> float:
        return _font(size * _FINE).size(text)[0] / _FINE
