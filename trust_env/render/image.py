"""`rgb_array`: a frame as pixels, drawn without a window."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pygame

from trust_env.render.canvas import Canvas
from trust_env.render.palette import PAPER
from trust_env.render.panel import draw_panel
from trust_env.render.plan import View, draw_frame, draw_ground
from trust_env.render.scene import Scene, read_scene

if TYPE_CHECKING:
    from trust_env.parallel import TrustEnv

MAP, PANEL = 720, 270  # pixels: the side of the map, the width of the column beside it
SIZE = (MAP + PANEL, MAP)


class ImageRenderer:
    """Draws the present frame as uint8[720, 990, 3]; the same world gives the same pixels."""

    def __init__(self, env: TrustEnv):
        self._env = env
        self._ground: tuple[bytes, Canvas] | None = None

    def draw(self) -> np.ndarray:
        pixels = pygame.surfarray.array3d(self.draw_surface())
        return np.ascontiguousarray(pixels.swapaxes(0, 1))

    def draw_surface(self) -> pygame.Surface:
        scene = read_scene(self._env)
        view = View(scene.extent, (0, 0, MAP, MAP))
        canvas = self._ground_of(scene, view).copy()
        draw_frame(canvas, view, scene)
        draw_panel(canvas, (MAP, 0, PANEL, MAP), scene)
        return canvas.to_surface()

    def _ground_of(self, scene: Scene, view: View) -> Canvas:
        """What agents see and where they stand changes with the episode only, so it is kept."""
        key = b"".join(agent.outline.tobytes() for agent in scene.agents)
        if self._ground is None or self._ground[0] != key:
            canvas = Canvas(SIZE, PAPER)
            canvas.clip(view.box)
            draw_ground(canvas, view, scene)
            canvas.clip(None)
            self._ground = (key, canvas)
        return self._ground[1]

    def close(self) -> None:
        self._ground = None
