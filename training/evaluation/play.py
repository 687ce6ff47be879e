"""Episodes of a batch of worlds, played to the end and measured."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from trust_env.agents import Player
from trust_env.metrics import EpisodeMetrics
from trust_env.training.console import Advance
from trust_env.vector import VectorEnv


def play_frames(
    venv: VectorEnv,
    policies: Mapping[str, Any],
    worlds: np.ndarray,
    seed: int,
    frames: int,
    advance: Advance = lambda _: None,
) -> Iterator[dict[str, Any]]:
    """Episode 0 of the given worlds[venv.num_worlds] of a seed: what the step of every frame informs of.

    policies: by role or agent, as a `Player` takes them.
    """
    player = Player(venv, policies)
    observations, _ = venv.reset(seed, options={"worlds": worlds, "episodes": np.zeros_like(worlds)})
    for _ in range(frames):
        observations, _, _, _, info = venv.step(player.actions(observations))
        yield info
        advance(1)


def measure_frames(venv: VectorEnv, frames: Iterable[dict[str, Any]]) -> EpisodeMetrics:
    """All metrics of the episodes that `play_frames` plays in `venv`."""
    metrics = EpisodeMetrics(venv)
    for info in frames:
        metrics.update(info)
    return metrics
