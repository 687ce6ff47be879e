"""From metres to pixels, and back."""

from __future__ import annotations

import numpy as np

from trust_env.render.canvas import Box
from trust_env.render.scene import Extent


class Camera:
    """Fits an extent (m) into the middle of a box (pixels), at one scale for both axes."""

    def __init__(self, extent: Extent, box: Box):
        x_min, x_max, y_min, y_max = extent
        x, y, width, height = box
        self.box = box
        self.scale = min(width / (x_max - x_min), height / (y_max - y_min))  # pixels per metre
        self._centre = np.array([x_min + x_max, y_min + y_max]) / 2  # [2], m
        self._middle = np.array([x + width / 2, y + height / 2])  # [2], pixels

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """Points [..., 2] (m) in pixels."""
        return self._middle + (points - self._centre) * (self.scale, -self.scale)

    def metres(self, pixels: np.ndarray) -> np.ndarray:
        """Points [..., 2] (pixels) in metres."""
        return self._centre + (pixels - self._middle) / (self.scale, -self.scale)
