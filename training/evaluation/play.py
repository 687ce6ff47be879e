"""Episodes of a batch of worlds, played to the end and measured."""

from __future__ import annotations

from collections.abc import Mapping
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
    player, metrics = Player(venv, policies), EpisodeMetrics(venv)
    observations, _ = venv.reset(seed, options={"worlds": worlds, "episodes": np.zeros_like(worlds)})
    for _ in range(frames):
        observations, _, _, _, info = venv.step(player.actions(observations))
        metrics.update(info)
        advance(1)
    return metrics
