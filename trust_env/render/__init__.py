"""A frame of a world as an image, in a window, or as text. Imported when first asked for."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from trust_env.batch import Batch

__all__ = ["Renderer", "make_renderer"]


class Renderer(Protocol):
    """What an environment's `render` and `close` call."""

    def draw(self) -> np.ndarray | str | None:
        """The present frame: uint8[H, W, 3], text, or None where it went to a window."""

    def close(self) -> None:
        """Release everything; may be called twice."""


def make_renderer(worlds: Batch, render_mode: str, fps: float) -> Renderer:
    """The renderer of the first world: "rgb_array", "human" (at most `fps` frames per second) or "ansi".

    Raises ImportError, naming the extra, where pygame is missing.
    """
    if render_mode == "ansi":
        from trust_env.render.text import TextRenderer

        return TextRenderer(worlds)
    _require_pygame(render_mode)
    from trust_env.render.image import ImageRenderer
    from trust_env.render.window import WindowRenderer

    return WindowRenderer(worlds, fps) if render_mode == "human" else ImageRenderer(worlds)


def _require_pygame(render_mode: str) -> None:
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pygame prints a greeting otherwise
    try:
        import pygame  # noqa: F401
    except ImportError as error:
        message = f'render_mode="{render_mode}" needs pygame-ce: pip install "trust-env[render]"'
        raise ImportError(message) from error
