"""What a world looks like: as an image, in a window, or as text. Imported when first asked for."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from trust_env.parallel import TrustEnv

__all__ = ["Renderer", "make_renderer"]


class Renderer(Protocol):
    """What the environment's `render` needs."""

    def draw(self) -> np.ndarray | str | None:
        """The present frame: uint8[H, W, 3], text, or None when it went to a window."""

    def close(self) -> None:
        """Give everything back; may be called twice."""


def make_renderer(env: TrustEnv) -> Renderer:
    """The renderer of `env.render_mode`: "rgb_array", "human" or "ansi".

    Raises ImportError, naming the extra, where pygame is missing.
    """
    if env.render_mode == "ansi":
        from trust_env.render.text import TextRenderer

        return TextRenderer(env)
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pygame greets on the screen otherwise
    try:
        import pygame  # noqa: F401
    except ImportError as error:
        raise ImportError(
            f'render_mode="{env.render_mode}" needs pygame-ce: pip install "trust-env[render]"'
        ) from error
    from trust_env.render.image import ImageRenderer
    from trust_env.render.window import WindowRenderer

    return WindowRenderer(env) if env.render_mode == "human" else ImageRenderer(env)
