"""What an episode is judged by: the picture against the truth, and trust against who deserved it.

Rewards have no part in it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from trust_env.metrics.agent_record import AgentRecord
from trust_env.metrics.picture_record import PictureRecord
from trust_env.metrics.registry import METRICS
from trust_env.metrics.track_record import TrackRecord


class EpisodeMetrics:
    """Records one episode of every world of a `VectorEnv` (without autoreset) or of a `TrustEnv`.

    Call `update` after each `step`, then `result`.
    """

    def __init__(self, env: Any):
        env = getattr(env, "unwrapped", env)
        if getattr(env, "autoreset", False):
            raise ValueError("metrics need the last frame of an episode: make the environment with autoreset=False")
        self._worlds = env.worlds
        self._frames = 0
        n, settings = self._worlds.num_worlds, self._worlds.scenario.metrics
        self._picture, self._tracks = PictureRecord(n), TrackRecord(n)
        self._agents = AgentRecord(n, self._worlds.roles > 0, settings.accuse_below, settings.accuse_frames)

    def update(self, info: Mapping[str, Any] | None = None) -> None:
        """Take in a frame; `info` is what `VectorEnv.step` returned, or None to ask the worlds for it."""
        self._frames += 1
        arrays = self._worlds.arrays
        self._picture.update(self._frames, info if info is not None and "gospa" in info else self._worlds.metrics())
        self._tracks.update(arrays)
        self._agents.update(self._frames, arrays.agent_trust, arrays.first_edit)

    def result(self) -> dict[str, np.ndarray]:
        """Every name of `METRICS`: float64[W], NaN where it is absent."""
        tracks, _ = self._tracks.result()
        found = self._picture.result(self._frames) | tracks | self._agents.result()
        return {name: found[name] for name in METRICS}
