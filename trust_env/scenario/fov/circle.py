"""The FOV that looks all around."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.scenario.fov.shape import INSIDE, FovShape, arc, edge_of_circle
from trust_env.scenario.types import LENGTH


@dataclass(frozen=True)
class Circle(FovShape):
    """All points within `radius` of the agent."""

    is_round: ClassVar[bool] = True

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

    @staticmethod
    @kernel
    def holds(fov, frame, x, y):
        return True

    @staticmethod
    @kernel
    def nearest_inside(fov, reach, frame, x, y):
        dx, dy = x - frame[0], y - frame[1]
        distance, angle = min(math.hypot(dx, dy), reach * INSIDE), math.atan2(dy, dx)
        return frame[0] + distance * math.cos(angle), frame[1] + distance * math.sin(angle)

    @staticmethod
    @kernel
    def box(fov, reach, frame):
        return frame[0] - reach, frame[0] + reach, frame[1] - reach, frame[1] + reach

    @staticmethod
    @kernel
    def edge(fov, reach, frame, x, y):
        return edge_of_circle(reach, frame, x, y)

    @staticmethod
    @kernel
    def candidate(fov, reach, frame, first, second):
        distance, angle = reach * math.sqrt(first), (2.0 * second - 1.0) * math.pi
        return frame[0] + distance * math.cos(angle), frame[1] + distance * math.sin(angle)
