"""Episodes of a batch of worlds, played to the end and measured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from trust_env.agents import Player
from trust_env.metrics import EpisodeMetrics
from trust_env.training.console import Advance
from trust_env.vector import VectorEnv


def play_worlds(
    venv: VectorEnv,
    policies: Mapping[str, Any],
    worlds: np.ndarray,
    seed: int,
    frames: int,
    advance: Advance = lambda _: None,
) -> EpisodeMetrics:
    """The metrics of episode 0 of the given worlds[venv.num_worlds] of a seed.

    policies: by role or agent, as a `Player` takes them.
    """
    metrics = EpisodeMetrics(venv)
    for info in play_frames(venv, policies, worlds, seed, frames, advance):
        metrics.update(info)
    return metrics


def play_frames(
    venv: VectorEnv,
    policies: Mapping[str, Any],
    worlds: np.ndarray,
    seed: int,
    frames: int,
    advance: Advance = lambda _: None,
) -> Iterator[dict[str, Any]]:
    """What every frame's step informs of, in the episodes that `play_worlds` measures."""
    player = Player(venv, policies)
    observations, _ = venv.reset(seed, options={"worlds": worlds, "episodes": np.zeros_like(worlds)})
    for _ in range(frames):
        observations, _, _, _, info = venv.step(player.actions(observations))
        yield info
        advance(1)
