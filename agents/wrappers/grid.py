"""Discrete: phantoms on the points of a grid."""

from __future__ import annotations

import numpy as np
from gymnasium.spaces import MultiDiscrete

from trust_env.agents.base import PolicyContext
from trust_env.agents.parameters import whole_number
from trust_env.agents.wrappers.placed import PlacedPhantoms
from trust_env.agents.wrappers.reference_frame import OUTWARD, clip_to_fov
from trust_env.agents.wrappers.suppression import CHOICES, suppressed
from trust_env.spaces.observation import REACH

KEEP, WITHDRAW, FIRST_POINT = 0, 1, 2  # choices for a phantom


class Grid(PlacedPhantoms):
    """`MultiDiscrete([2 + g²] * P + [4])`: per phantom 0 keep, 1 withdraw, 2 + i point to point i of a g x g
    grid over the square about the own FOV, from the lowest x and y on, y first; then which own detections are
    suppressed: 0 none, 1 those in the nearer half of the FOV, 2 the others, 3 all.

    Where there is no phantom, one appears at the point, or on the FOV's edge before it; one that is there
    stays, or moves at `speed` in the direction of the point, until it is withdrawn.

    g            points of the grid along x and along y
    n            phantoms per learner, at most two per injection slot; None: the largest injection budget
    speed        m/s; 0: they stay where they appear
    frame        outward | area: the directions of x and y
    knowledge    level whose fields a learner sees; None: the scenario's
    """

    name = "grid"

    def __init__(
        self,
        g: int = 5,
        n: int | None = None,
        speed: float = 0.0,
        frame: str = OUTWARD,
        knowledge: str | None = None,
    ):
        super().__init__(n, speed, frame, knowledge)
        self.g = whole_number(self.name, "g", g, 2)

    def prepare(self, context: PolicyContext) -> int:
        size = super().prepare(context)
        self.action_space = MultiDiscrete([FIRST_POINT + self.g**2] * self.phantoms + [CHOICES])
        along = np.linspace(-1.0, 1.0, self.g)
        points = (along[:, None] + 1j * along).reshape(-1)
        self._points = np.concatenate([np.zeros(FIRST_POINT), points]).astype(np.complex64)
        return size

    def act(self, choices: np.ndarray, observations: np.ndarray) -> np.ndarray:
        chosen, suppress = choices[..., :-1], choices[..., -1:]
        self.reference.set_poses(observations)
        pointed = clip_to_fov(self._points[chosen])
        kept = (chosen >= FIRST_POINT) | ((chosen == KEEP) & self.exists)
        self.move(pointed, pointed * np.float32(REACH), kept)
        return self.encode(suppressed(suppress, self.reference.detections(observations)))
