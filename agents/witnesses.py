"""Who outside the coalition sees a point: every such agent counts as honest."""

from __future__ import annotations

import numpy as np

from trust_env.agents.base import PolicyContext
from trust_env.scenario import Fovs


class Witnesses:
    """The H agents that a policy does not play; where they stand is in the field `poses` of observations."""

    def __init__(self, context: PolicyContext):
        self.agents = np.setdiff1d(np.arange(context.scenario.n_agents), context.agents)  # int[H]
        self._fovs = Fovs.of(context.scenario, self.agents)

    def see(self, seen: dict[str, np.ndarray], points: np.ndarray) -> np.ndarray:
        """Which of them see points[w, ..., 2], bool[w, H, ...]."""
        poses = seen["poses"][:, 0, self.agents]  # [w, H, 4]: every agent sees the same
        flat = points.reshape(len(points), 1, -1, 2)
        return self._fovs.contains(poses, flat).reshape(len(points), len(self.agents), *points.shape[1:-1])
