"""What all FOV shapes share: one FOV on its own, n of them as arrays, and the agents' frames.

An agent's own frame has its origin at the agent, x ahead and y left. A pose of arrays is (x, y, cos, sin) of
position (m) and heading, as observations give it; everything on arrays is elementwise, so that the numbers of
a world do not depend on the batch that it is computed in.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from trust_env.compiled.kernels import inlined

INSIDE = 1.0 - 1e-6  # a point drawn from an FOV is inside, whatever the rounding
_ARC_STEP = math.radians(3.0)  # between the corners that stand for a round outline


class FovGroup:
    """The FOVs of n agents that have one shape; as it stands here, circles.

    reach[n]: m, distance of the farthest point; axis[n], half_width[n]: rad, middle and half of the angle
    that an FOV opens about the agent.
    """

    def __init__(self, shapes: Sequence[FovShape]):
        self.reach = np.array([shape.reach for shape in shapes])
        self.axis, self.half_width = np.array([shape.opening for shape in shapes]).T

    def contains(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Φ, bool[..., n, P], of points u, v [..., n, P] (m) in the agents' frames."""
        reach = self.reach[:, None]
        return u * u + v * v <= reach * reach

    def boxes(self, pose: np.ndarray) -> np.ndarray:
        """x_min, x_max, y_min, y_max (m) [..., n, 4] in the world, for pose[..., n, 4]."""
        x, y, reach = pose[..., 0], pose[..., 1], self.reach
        return np.stack([x - reach, x + reach, y - reach, y + reach], axis=-1)

    def sample(self, draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Uniform points u, v [..., n, P] (m) in the agents' frames, from U[0, 1) draws[..., n, P, 3]."""
        first, second = (np.ascontiguousarray(draws[..., i]) for i in range(2))
        distance = INSIDE * self.reach[:, None] * np.sqrt(first)
        angle = self.axis[:, None] + INSIDE * self.half_width[:, None] * (2.0 * second - 1.0)
        return distance * np.cos(angle), distance * np.sin(angle)


@dataclass(frozen=True)
class FovShape(ABC):
    """One FOV in its agent's own frame; its fields are those of the scenario's `fov` that its type has.

    Its kernels work in the world, in metres. `fov` are its `numbers`, `frame[5]` is where its own frame is, the
    agent's turned by the middle of the opening: x, y, heading, then the heading's cos and sin.

    holds(fov, frame, x, y): whether a point within reach lies in the FOV
    nearest_inside(fov, reach, frame, x, y): for a point outside, one just inside
    box(fov, reach, frame): x_min, x_max, y_min, y_max
    edge(fov, reach, frame, x, y): m from a point to the nearest edge, negative outside, and that edge's normal
    candidate(fov, reach, frame, first, second): a point from two U[0, 1) draws; those that the FOV holds are
        uniform in it
    """

    group: ClassVar[type[FovGroup]] = FovGroup
    is_round: ClassVar[bool] = False  # whether it holds whatever lies within its reach
    holds: ClassVar[Any]
    nearest_inside: ClassVar[Any]
    box: ClassVar[Any]
    edge: ClassVar[Any]
    candidate: ClassVar[Any]

    @abstractmethod
    def faults(self) -> dict[str, str]:
        """What was expected, by the name of each field that is wrong."""

    @property
    @abstractmethod
    def area(self) -> float:
        """m^2"""

    @property
    @abstractmethod
    def reach(self) -> float:
        """m, distance of the farthest point from the agent."""

    @property
    def numbers(self) -> list[float]:
        """What its kernels know of it, beside its reach."""
        return []

    @property
    def opening(self) -> tuple[float, float]:
        """rad, middle and half of the angle that it opens about the agent."""
        return 0.0, math.pi

    @property
    def middle(self) -> tuple[float, float]:
        """m, a point well inside: the centroid of a sector with half width h, 2/3 r sin(h)/h away."""
        axis, half = self.opening
        distance = 2.0 / 3.0 * self.reach * math.sin(half) / half
        return distance * math.cos(axis), distance * math.sin(axis)

    @abstractmethod
    def outline(self, pose: np.ndarray) -> np.ndarray:
        """Corners [c, 2] (m) in the world, for a pose of x, y, heading (rad)."""


@inlined
def local_of(frame, x, y):
    """u, v of a point in an FOV's own frame."""
    dx, dy = x - frame[0], y - frame[1]
    return frame[3] * dx + frame[4] * dy, -frame[4] * dx + frame[3] * dy


@inlined
def edge_of_circle(reach, frame, x, y):
    """m from a point to the circle about the agent, negative outside, and the normal there."""
    dx, dy = x - frame[0], y - frame[1]
    distance = math.hypot(dx, dy)
    if distance == 0.0:
        return reach, 1.0, 0.0
    return reach - distance, dx / distance, dy / distance


@inlined
def global_of(frame, u, v):
    """x, y of a point in an FOV's own frame."""
    return frame[0] + frame[3] * u - frame[4] * v, frame[1] + frame[4] * u + frame[3] * v


def arc(pose: np.ndarray, radius: float, first: float, width: float) -> np.ndarray:
    """Points [c, 2] (m) in the world on an arc about the agent, from angle `first` (rad) on."""
    angles = first + np.linspace(0.0, width, math.ceil(width / _ARC_STEP) + 1)
    return pose[:2] + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def wrap_angle(angle):
    """An angle, or an array of them, in (-π, π]."""
    return np.pi - (np.pi - angle) % (2.0 * np.pi)


def to_local(pose: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points u, v in the agents' frames, of points[..., n, P, 2] (m) in the world."""
    x, y, c, s = (pose[..., None, i] for i in range(4))
    dx, dy = points[..., 0] - x, points[..., 1] - y
    return c * dx + s * dy, c * dy - s * dx


def to_global(pose: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points x, y (m) in the world, of u, v [..., n, P] in the agents' frames."""
    x, y, c, s = (pose[..., None, i] for i in range(4))
    return x + c * u - s * v, y + s * u + c * v


def box_around(pose: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """x_min, x_max, y_min, y_max (m) [..., n, 4] in the world, of points u, v [..., n, Q]."""
    x, y = to_global(pose, u, v)
    return np.stack([x.min(axis=-1), x.max(axis=-1), y.min(axis=-1), y.max(axis=-1)], axis=-1)
