"""`rgb_array`: a frame as pixels, drawn without a window."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pygame

from trust_env.render.camera import Camera
from trust_env.render.canvas import Canvas
from trust_env.render.map import draw_background, draw_frame
from trust_env.render.palette import BACKGROUND
from trust_env.render.panel import draw_panel
from trust_env.render.scene import Scene, read_scene

if TYPE_CHECKING:
    from trust_env.batch import Batch

MAP_SIZE, PANEL_WIDTH = 720, 270  # pixels: the side of the square map, the width of the column beside it
IMAGE_SIZE = (MAP_SIZE + PANEL_WIDTH, MAP_SIZE)


class ImageRenderer:
    """Draws the present frame as uint8[720, 990, 3]; the same world gives the same pixels."""

    def __init__(self, worlds: Batch):
        self._worlds = worlds
        self._background: tuple[bytes, Canvas] | None = None  # what it was drawn from, and the drawing

    def draw(self) -> np.ndarray:
        pixels = pygame.surfarray.array3d(self.draw_surface())
        return np.ascontiguousarray(pixels.swapaxes(0, 1))

    def draw_surface(self) -> pygame.Surface:
        scene = read_scene(self._worlds)
        camera = Camera(scene.extent, (0, 0, MAP_SIZE, MAP_SIZE))
        canvas = self._background_of(scene, camera).copy()
        draw_frame(canvas, camera, scene)
        draw_panel(canvas, (MAP_SIZE, 0, PANEL_WIDTH, MAP_SIZE), scene)
        return canvas.to_surface()

    def _background_of(self, scene: Scene, camera: Camera) -> Canvas:
        """Kept from frame to frame: agents and their FOVs change with the episode only."""
        key = b"".join(agent.outline.tobytes() for agent in scene.agents)
        if self._background is None or self._background[0] != key:
            canvas = Canvas(IMAGE_SIZE, BACKGROUND)
            canvas.clip(camera.box)
            draw_background(canvas, camera, scene)
            canvas.clip(None)
            self._background = (key, canvas)
        return self._background[1]

    def close(self) -> None:
        self._background = None
