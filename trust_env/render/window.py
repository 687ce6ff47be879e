"""`human`: the same picture in a window of its own, at the speed that the metadata gives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pygame

from trust_env.render.image import SIZE, ImageRenderer

if TYPE_CHECKING:
    from trust_env.parallel import TrustEnv


class WindowRenderer:
    """Opens its window with the first frame. When the user closes it the environment goes on, unseen."""

    def __init__(self, env: TrustEnv):
        self._image = ImageRenderer(env)
        self._title = f"trust-env: {env.scenario.name}"
        self._fps = float(env.metadata["render_fps"])
        self._clock = pygame.time.Clock()
        self._window: pygame.Window | None = None
        self._done = False

    def draw(self) -> None:
        if self._done:
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
            return pygame.Window(self._title, SIZE)
        except pygame.error as error:
            raise RuntimeError(
                f'render_mode="human" finds no display ({error}); "rgb_array" and "ansi" need none'
            ) from error

    @staticmethod
    def _closed_by_user(window: pygame.Window) -> bool:
        """Empty the queue of events; what tells of another environment's window is put back for it."""
        closed = False
        for event in pygame.event.get():
            if event.type == pygame.WINDOWCLOSE and getattr(event, "window", None) is not window:
                pygame.event.post(event)
            else:
                closed |= event.type in (pygame.WINDOWCLOSE, pygame.QUIT)
        return closed

    def close(self) -> None:
        self._done = True
        self._image.close()
        if self._window is not None:
            self._window.destroy()
            self._window = None
