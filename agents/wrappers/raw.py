"""The raw action: in every frame anew where injections go and which detections are suppressed."""

from __future__ import annotations

import numpy as np
from gymnasium.spaces import Box

from trust_env.agents.base import PolicyContext
from trust_env.agents.wrappers.wrapper import ActionWrapper


class Raw(ActionWrapper):
    """The environment's own actions and observations, for comparison.

    knowledge    level whose fields a learner sees; None: the scenario's
    """

    name = "raw"

    def prepare(self, context: PolicyContext) -> int:
        self.action_space = Box(-1.0, 1.0, (self._action_size,), np.float32)
        return 0

    def act(self, choices: np.ndarray, observations: np.ndarray) -> np.ndarray:
        return np.asarray(choices, dtype=np.float32)
