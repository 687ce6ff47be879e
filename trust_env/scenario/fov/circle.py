"""The FOV that looks all around."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from trust_env.scenario.fov.shape import FovShape, arc
from trust_env.scenario.types import LENGTH


@dataclass(frozen=True)
class Circle(FovShape):
    """All points within `radius` of the agent."""

    radius: float  # m

    def faults(self) -> dict[str, str]:
        return {} if self.radius >= LENGTH.least else {"radius": f"expected {LENGTH}, or the FOV sees nothing"}

    @property
    def area(self) -> float:
        return math.pi * self.radius**2

    @property
    def reach(self) -> float:
        return self.radius

    def outline(self, pose: np.ndarray) -> np.ndarray:
        return arc(pose, self.radius, 0.0, 2.0 * math.pi)[:-1]
