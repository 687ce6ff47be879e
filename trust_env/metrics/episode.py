"""What an episode is judged by: the picture against the truth, and trust against who deserved it.

Rewards have no part in it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from trust_env.metrics.agent_record import AgentRecord
from trust_env.metrics.course_record import CourseRecord
from trust_env.metrics.picture_record import PictureRecord
from trust_env.metrics.registry import METRICS
from trust_env.metrics.strata import Strata, sum_strata
from trust_env.metrics.track_record import TrackRecord, pack

RELIABILITY = ("track_trust", "agent_trust")


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
        self._missing = [np.empty(0, np.uint32)]  # the strata of missing targets
        n, settings = self._worlds.num_worlds, self._worlds.scenario.metrics
        self._picture, self._tracks = PictureRecord(n), TrackRecord(n)
        self._agents = AgentRecord(n, self._worlds.roles > 0, settings.accuse_below, settings.accuse_frames)
        self._courses = CourseRecord(self._worlds.roles > 0)

    def update(self, info: Mapping[str, Any] | None = None) -> None:
        """Take in a frame; `info` is what `VectorEnv.step` returned, or None to ask the worlds for it."""
        self._frames += 1
        arrays = self._worlds.arrays
        values = info if info is not None and "gospa" in info else self._worlds.metrics()
        self._picture.update(self._frames, values)
        self._courses.update(values, arrays.agent_trust)
        self._tracks.update(arrays)
        self._missing.append(pack(arrays.scored_watchers[np.nonzero(arrays.scored_missing)]))
        self._agents.update(self._frames, arrays.agent_trust, arrays.first_edit)

    def result(self) -> dict[str, np.ndarray]:
        """Every name of `METRICS`: float64[W], NaN where it is absent."""
        found = self._picture.result(self._frames) | self._tracks.result() | self._agents.result()
        return {name: found[name] for name in METRICS}

    def reliability(self) -> dict[str, np.ndarray]:
        """Trust in tracks and in agents as forecasts, `RELIABILITY`: float64[W, 3, N_BINS], of each tenth of [0, 1] how
        many forecasts fell into it, their sum, and how many came true.
        """
        return dict(zip(RELIABILITY, (self._tracks.trust_forecasts().bins, self._agents.forecasts.bins)))

    def courses(self) -> dict[str, np.ndarray]:
        """What the frames were like, `course_record.COURSES` by name: float64[W, T], NaN where undefined."""
        return self._courses.result()

    def trust_scores(self) -> np.ndarray:
        """How trust tells adversaries apart: agents by their mean trust, as `AgentRecord.score_counts` has them."""
        return self._agents.score_counts()

    def strata(self) -> Strata:
        """Sums over all worlds and frames by who watches, K_a adversaries and K_b benign agents."""
        return sum_strata(self._tracks.tracks(), np.concatenate(self._missing))
