"""Continuous: the learner points to places, and the view reports there frame after frame."""

from __future__ import annotations

import numpy as np
from gymnasium.spaces import Box

from agents.policy import PolicyContext
from agents.views.placed import OUTWARD, PlacedPhantoms

WITHDRAWN = -0.5  # a phantom is not reported where `report` is below: rarely, when actions are drawn
STRETCH = 1.0
BASE = 0.5
WIDEST = 2.0  # radius of the suppression disc at +1, in REACH radii of the FOV: it covers all


class Phantoms(PlacedPhantoms):
    """`Box(-1, 1, (3P + 3,))`: per phantom [report, x, y], then the suppression disc [x, y, radius].

    x and y point to a place over the bounding box of the own FOV. A phantom appears where they point, and
    afterwards follows them at `speed`. While `report` < -0.5 it is not reported; after five such frames in a
    row it is gone, and a new one may appear. Own detections inside the disc are suppressed; its radius goes
    from 0 at -1 over a third of the FOV's at 0 to all of the FOV at +1.

    n            phantoms per learner; None: the largest injection budget
    speed        m/s, 0: they stay where they appear; None: as the slowest targets
    knowledge    level whose fields a learner sees; None: the scenario's
    """

    name = "phantoms"

    def __init__(
        self,
        n: int | None = None,
        speed: float | None = None,
        frame: str = OUTWARD,
        knowledge: str | None = None,
    ):
        super().__init__(n, speed, frame, knowledge)

    def prepare(self, context: PolicyContext) -> int:
        length = super().prepare(context)
        self.action_space = Box(-1.0, 1.0, (3 * self.phantoms + 3,), np.float32)
        return length

    def act(self, choices: np.ndarray, observations: np.ndarray) -> np.ndarray:
        choices = np.clip(choices, -1.0, 1.0).astype(np.float32)
        self.look(observations)
        report, x, y = (choices[..., i:-3:3] for i in range(3))
        a = 2 * np.pi * (np.arange(self.phantoms) + 0.5) / self.phantoms
        bx, by = (BASE * np.cos(a)).astype(np.float32), (BASE * np.sin(a)).astype(np.float32)
        self.move(self.over_fov(bx + STRETCH * x, by + STRETCH * y), report >= WITHDRAWN)
        return self.actions(self._covered(choices[..., -3:], observations))

    def _covered(self, disc: np.ndarray, observations: np.ndarray) -> np.ndarray:
        """Which own detections bool[W, n, D] lie inside the suppression discs [W, n, 3]."""
        centre = self.over_fov(disc[..., 0:1], disc[..., 1:2])
        radius = np.float32(WIDEST) * (0.5 + 0.5 * disc[..., 2:]) ** 3
        return np.abs(self.detections(observations) - centre) < radius
