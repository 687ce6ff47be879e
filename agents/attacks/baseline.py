"""What attacks are compared with: doing nothing, and doing anything."""

from __future__ import annotations

import numpy as np

from trust_env.agents.base import ACTION, Policy
from trust_env.spaces.action import ActionTable


class Honest(Policy):
    """The zero action: reports what it has detected. The control of every comparison."""

    name = "honest"

    def act(self, observations: np.ndarray) -> np.ndarray:
        self.frame += 1
        return self.zero_actions()


class Random(Policy):
    """Uniform actions within the budget: a slot fires, a detection is suppressed, with probability 1/2."""

    name = "random"

    def act(self, observations: np.ndarray) -> np.ndarray:
        actions = self.zero_actions()
        actions[...] = 2.0 * self.draw(ACTION, actions.shape[-1]) - 1.0
        table = ActionTable(self.context.scenario)
        slots, entries = actions[..., table["injections"]], actions[..., table["suppressions"]]
        slots[:, np.arange(slots.shape[-1]) // 3 >= self.injections[:, None]] = 0.0
        entries[:, np.arange(entries.shape[-1]) >= self.suppressions[:, None]] = 0.0
        self.frame += 1
        return actions
