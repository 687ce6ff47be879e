"""The picture at the top of the README: one frame of `patrol` under attack, as `render` shows it.

python docs/picture.py
"""

from __future__ import annotations

from pathlib import Path

import pygame

import trust_env
from trust_env.agents import Player

FILE = Path(__file__).parent / "pages" / "picture.png"
SEED, FRAME = 3, 60


def draw(file: Path = FILE) -> None:
    """Write the picture to a PNG."""
    env = trust_env.parallel_env("patrol", "trust", render_mode="rgb_array")
    player = Player(env, {"adversary": "false_positive"})
    observations, _ = env.reset(seed=SEED)
    for _ in range(FRAME):
        observations, *_ = env.step(player.actions(observations))
    image = env.render()
    surface = pygame.surfarray.make_surface(image.swapaxes(0, 1))
    pygame.image.save(surface, str(file))
    env.close()


if __name__ == "__main__":
    draw()
