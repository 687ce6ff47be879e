"""Discrete: phantoms on the points of a grid."""

from __future__ import annotations

import numpy as np
from gymnasium.spaces import MultiDiscrete

from agents.parameters import whole
from agents.policy import PolicyContext
from agents.views.placed import OUTWARD, PATIENCE, PlacedPhantoms
from trust_env.observation import REACH

KEEP, WITHDRAW, FIRST_POINT = 0, 1, 2  # choices for a phantom
NONE, NEAR, FAR, ALL = range(4)  # choices of what is suppressed
NEARER_HALF = np.sqrt(0.5) / REACH  # distance in REACH radii: half of a circle's area lies within


class Grid(PlacedPhantoms):
    """`MultiDiscrete([2 + g²] * P + [4])`: per phantom 0 keep, 1 withdraw, 2 + i point to point i of a g x g
    grid over the bounding box of the own FOV, from the lowest x and y on, y first; then which own detections
    are suppressed: 0 none, 1 those in the nearer half of the FOV, 2 the others, 3 all.

    Where there is no phantom, one appears at the point; one that is there moves toward it at `speed`, and is
    reported as long as it is not withdrawn.

    g            points of the grid along x and along y
    n            phantoms per learner; None: the largest injection budget
    speed        m/s, 0: they stay where they appear; None: as the slowest targets
    knowledge    level whose fields a learner sees; None: the scenario's
    """

    name = "grid"

    def __init__(
        self,
        g: int = 5,
        n: int | None = None,
        speed: float | None = None,
        frame: str = OUTWARD,
        knowledge: str | None = None,
    ):
        super().__init__(n, speed, frame, knowledge)
        self.g = whole(self.name, "g", g, 2)

    def prepare(self, context: PolicyContext) -> int:
        length = super().prepare(context)
        self.action_space = MultiDiscrete([FIRST_POINT + self.g**2] * self.phantoms + [ALL + 1])
        along = np.linspace(-1.0, 1.0, self.g, dtype=np.float32)
        nowhere = np.zeros(FIRST_POINT, dtype=np.float32)
        self._x = np.concatenate([nowhere, np.repeat(along, self.g)])
        self._y = np.concatenate([nowhere, np.tile(along, self.g)])
        return length

    def act(self, choices: np.ndarray, observations: np.ndarray) -> np.ndarray:
        chosen, suppress = choices[..., :-1], choices[..., -1:]
        self.look(observations)
        pointed, stays = self.over_fov(self._x[chosen], self._y[chosen]), chosen == KEEP
        reported = (chosen >= FIRST_POINT) | (stays & (self.silent < PATIENCE))
        self.move(np.where(stays, self.place, pointed), reported)
        self.silent[chosen == WITHDRAW] = PATIENCE
        near = np.abs(self.detections(observations)) < NEARER_HALF
        return self.actions((suppress == ALL) | np.where(near, suppress == NEAR, suppress == FAR))
