"""`human`: the image in a window of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pygame

from trust_env.render.image import IMAGE_SIZE, ImageRenderer

if TYPE_CHECKING:
    from trust_env.batch import Batch


class WindowRenderer:
    """Opens its window with the first frame. After the user has closed it, frames are no longer drawn.

    fps: frames per second at most; `draw` waits for its turn.
    """

    def __init__(self, worlds: Batch, fps: float):
        self._image = ImageRenderer(worlds)
        self._title = f"trust-env: {worlds.scenario.name}"
        self._fps = float(fps)
        self._clock = pygame.time.Clock()
        self._window: pygame.Window | None = None
        self._closed = False

    def draw(self) -> None:
        if self._closed:
            return
        if self._window is None:
            self._window = self._open()
        if self._closed_by_user(self._window):
            self.close()
            return
        self._window.get_surface().blit(self._image.draw_surface(), (0, 0))
        self._window.flip()
        self._clock.tick(self._fps)

    def _open(self) -> pygame.Window:
        try:
            pygame.display.init()
            return pygame.Window(self._title, IMAGE_SIZE)
        except pygame.error as error:
            raise RuntimeError(
                f'render_mode="human" finds no display ({error}); "rgb_array" and "ansi" need none'
            ) from error

    @staticmethod
    def _closed_by_user(window: pygame.Window) -> bool:
        """Empty the event queue; the closing of another environment's window is put back for that one."""
        closed = False
        for event in pygame.event.get():
            if event.type == pygame.WINDOWCLOSE and getattr(event, "window", None) is not window:
                pygame.event.post(event)
            else:
                closed |= event.type in (pygame.WINDOWCLOSE, pygame.QUIT)
        return closed

    def close(self) -> None:
        self._closed = True
        self._image.close()
        if self._window is not None:
            self._window.destroy()
            self._window = None
