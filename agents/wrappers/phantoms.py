"""Continuous: the learner points to places, and the wrapper reports there frame after frame."""

from __future__ import annotations

import numpy as np
from gymnasium.spaces import Box

from trust_env.agents.base import PolicyContext
from trust_env.agents.wrappers.placed import PlacedPhantoms
from trust_env.agents.wrappers.reference_frame import OUTWARD, Points, clip_to_fov

WITHDRAWN = -0.8  # `report` below it: drawn about 0, a phantom lives for some ten frames
APART = 0.5  # radii of the FOV: actions of 0 point to this circle, each to its own place
STRETCH = 3.0  # radii of the FOV: how far from there 1 points; drawn about 0, most are at the edge
WIDEST = 2.0  # radius of the suppression disc at +1, in REACH radii of the FOV: it covers all


class Phantoms(PlacedPhantoms):
    """`Box(-1, 1, (3P + 3,))`: per phantom [report, x, y], then the suppression disc [x, y, radius].

    A phantom appears three FOV radii times (x, y) from its own point of a circle of half the FOV's radius, or
    on the FOV's edge before that. It stays there, or moves by (x, y) times `speed`, until `report` is below
    -0.8; then it is withdrawn, and a new one can appear. Own detections inside the disc about (x, y), in FOV
    radii, are suppressed; its radius is 0 at -1, a third of the FOV's at 0, and covers all at 1.

    n            phantoms per learner, at most two per injection slot; None: the largest injection budget
    speed        m/s; 0: they stay where they appear
    frame        outward | area: the directions of x and y
    knowledge    level whose fields a learner sees; None: the scenario's
    """

    name = "phantoms"

    def __init__(
        self,
        n: int | None = None,
        speed: float = 0.0,
        frame: str = OUTWARD,
        knowledge: str | None = None,
    ):
        super().__init__(n, speed, frame, knowledge)

    def prepare(self, context: PolicyContext) -> int:
        size = super().prepare(context)
        self.action_space = Box(-1.0, 1.0, (3 * self.phantoms + 3,), np.float32)
        angle = 2.0 * np.pi * (np.arange(self.phantoms) + 0.5) / max(self.phantoms, 1)
        self._apart = (APART * np.exp(1j * angle)).astype(np.complex64)
        return size

    def act(self, choices: np.ndarray, observations: np.ndarray) -> np.ndarray:
        choices = np.clip(choices, -1.0, 1.0).astype(np.float32)
        self.reference.set_poses(observations)
        report, steered = choices[..., 0:-3:3], _complex(choices[..., 1:-3:3], choices[..., 2:-3:3])
        pointed = clip_to_fov(self._apart + np.float32(STRETCH) * steered)
        self.move(pointed, steered, report >= WITHDRAWN)
        return self.encode(self._covered(choices[..., -3:], observations))

    def _covered(self, disc: np.ndarray, observations: np.ndarray) -> np.ndarray:
        """Which own detections bool[W, n, D] lie inside the suppression discs [W, n, 3]."""
        centre = clip_to_fov(_complex(disc[..., 0:1], disc[..., 1:2]))
        radius = np.float32(WIDEST) * (0.5 + 0.5 * disc[..., 2:]) ** 3
        return np.abs(self.reference.detections(observations) - centre) < radius


def _complex(x: np.ndarray, y: np.ndarray) -> Points:
    """x + iy."""
    out: Points = np.empty(x.shape, dtype=np.complex64)
    out.real, out.imag = x, y
    return out
