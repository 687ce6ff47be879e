"""The FOV that opens to one side, with its apex at the agent."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.scenario.fov.circle import Circle
from trust_env.scenario.fov.shape import (
    INSIDE,
    FovGroup,
    arc,
    box_around,
    edge_of_circle,
    local_of,
    wrap_angle,
)


class SectorGroup(FovGroup):
    """The FOVs of n agents that are sectors; one that opens all around is a circle."""

    def contains(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        near = super().contains(u, v)
        if (self.half_width >= np.pi).all():
            return near
        off_axis = wrap_angle(np.arctan2(v, u) - self.axis[:, None])
        half = self.half_width[:, None]
        return near & ((np.abs(off_axis) <= half) | (half >= np.pi) | ((u == 0.0) & (v == 0.0)))

    def boxes(self, pose: np.ndarray) -> np.ndarray:
        partial = self.half_width[:, None] < np.pi
        return np.where(partial, box_around(pose, *self._extremes(pose)), super().boxes(pose))

    def _extremes(self, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Local u, v [..., n, 6]: the ends of the arc and its outermost points in the world, or the apex."""
        compass = np.arange(4) * (np.pi / 2.0) - np.arctan2(pose[..., 3], pose[..., 2])[..., None]
        axis, half = self.axis[:, None], self.half_width[:, None]
        ends = np.broadcast_to(axis + half * np.array([1.0, -1.0]), (*compass.shape[:-1], 2))
        on_arc = np.abs(wrap_angle(compass - axis)) <= half
        on_arc = np.concatenate([np.ones(ends.shape, dtype=bool), on_arc], axis=-1)
        angle, distance = np.concatenate([ends, compass], axis=-1), np.where(on_arc, self.reach[:, None], 0.0)
        return distance * np.cos(angle), distance * np.sin(angle)


@dataclass(frozen=True)
class Sector(Circle):
    """The part of a circle that opens `width` about `heading`."""

    group = SectorGroup
    is_round: ClassVar[bool] = False

    heading: float  # rad, middle of the sector, from the agent's own heading
    width: float  # rad, total opening

    def faults(self) -> dict[str, str]:
        if 0 < self.width <= 2 * math.pi:
            return super().faults()
        text = "expected radians above 0, or the FOV sees nothing, and at most 2 pi (6.283185307179586)"
        return super().faults() | {"width": text}

    @property
    def area(self) -> float:
        return self.width * self.radius**2 / 2

    @property
    def numbers(self) -> list[float]:
        """Half its opening, rad."""
        return [self.width / 2.0]

    @property
    def opening(self) -> tuple[float, float]:
        return self.heading, self.width / 2.0

    def outline(self, pose: np.ndarray) -> np.ndarray:
        if self.width >= 2.0 * math.pi:
            return super().outline(pose)
        first = pose[2] + self.heading - self.width / 2
        return np.concatenate([pose[None, :2], arc(pose, self.radius, first, self.width)])

    @staticmethod
    @kernel
    def holds(fov, frame, x, y):
        dx, dy = x - frame[0], y - frame[1]
        if fov[0] >= math.pi or (dx == 0.0 and dy == 0.0):
            return True
        return abs(_wrap(math.atan2(dy, dx) - frame[2])) <= fov[0]

    @staticmethod
    @kernel
    def nearest_inside(fov, reach, frame, x, y):
        dx, dy = x - frame[0], y - frame[1]
        distance, off_axis = min(math.hypot(dx, dy), reach * INSIDE), _wrap(math.atan2(dy, dx) - frame[2])
        if fov[0] < math.pi:
            off_axis = max(-fov[0] * INSIDE, min(fov[0] * INSIDE, off_axis))
        angle = frame[2] + off_axis
        return frame[0] + distance * math.cos(angle), frame[1] + distance * math.sin(angle)

    @staticmethod
    @kernel
    def box(fov, reach, frame):
        x0, x1, y0, y1 = frame[0], frame[0], frame[1], frame[1]
        for corner in range(6):  # the ends of the arc, and those of the four compass points that it holds
            angle = frame[2] + (fov[0] if corner == 0 else -fov[0])
            if corner >= 2:
                angle = (corner - 2) * 0.5 * math.pi
            if corner < 2 or abs(_wrap(angle - frame[2])) <= fov[0]:
                x, y = frame[0] + reach * math.cos(angle), frame[1] + reach * math.sin(angle)
                x0, x1, y0, y1 = min(x0, x), max(x1, x), min(y0, y), max(y1, y)
        return x0, x1, y0, y1

    @staticmethod
    @kernel
    def edge(fov, reach, frame, x, y):
        margin, nx, ny = edge_of_circle(reach, frame, x, y)
        if fov[0] >= math.pi:
            return margin, nx, ny
        straight, nu, nv = _straight_edge(fov[0], *local_of(frame, x, y))
        if margin <= straight:
            return margin, nx, ny
        return straight, frame[3] * nu - frame[4] * nv, frame[4] * nu + frame[3] * nv

    @staticmethod
    @kernel
    def candidate(fov, reach, frame, first, second):
        distance, angle = reach * math.sqrt(first), frame[2] + (2.0 * second - 1.0) * fov[0]
        return frame[0] + distance * math.cos(angle), frame[1] + distance * math.sin(angle)


_wrap = kernel(wrap_angle)


@kernel
def _straight_edge(half_width, u, v):
    """m from a point in the sector's own frame to the nearer of its straight edges, or to its apex, negative
    outside, and the normal there.
    """
    side = 1.0 if v >= 0.0 else -1.0  # which edge is nearer: the sector is symmetric about its middle
    cos, sin = math.cos(half_width), side * math.sin(half_width)
    sign = 1.0 if abs(math.atan2(v, u)) <= half_width else -1.0
    if u * cos + v * sin > 0.0:
        return sign * abs(v * cos - u * sin), -sin, cos
    distance = math.hypot(u, v)
    if distance == 0.0:
        return 0.0, 1.0, 0.0
    return sign * distance, u / distance, v / distance
