"""An episode as a moving image, drawn by the environment's own renderer; two defenses stand side by side."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from trust_env.defenses import build_defense
from trust_env.files import write_atomically
from trust_env.parallel import TrustEnv
from trust_env.training.replays.episode import Episode
from trust_env.training.replays.recording import frames_of


def save_gif(file: Path, episodes: Sequence[Episode]) -> None:
    """Write the episodes, of equal length, as one GIF that begins anew at its end.

    ImportError, naming the extra: pygame-ce or Pillow is missing; OSError: the file cannot be written.
    """
    if importlib.util.find_spec("PIL") is None:
        raise ImportError('a .gif needs Pillow: pip install "trust-env[plot]"')
    from PIL import Image

    pairs = zip(*(_images(episode) for episode in episodes), strict=True)
    first, *others = (Image.fromarray(np.hstack(pair)).quantize(colors=128) for pair in pairs)
    frame_ms = 1000 // TrustEnv.metadata["render_fps"]
    write_atomically(
        file,
        lambda unfinished: first.save(
            unfinished, format="GIF", save_all=True, append_images=others, duration=frame_ms, loop=0
        ),
    )


def _images(episode: Episode) -> list[np.ndarray]:
    """uint8[H, W, 3] of every frame."""
    env = TrustEnv(episode.scenario, build_defense(episode.judge), "rgb_array", episode.frames)
    try:
        return [np.asarray(env.render()) for _ in frames_of(env, episode)]
    finally:
        env.close()
