"""Fields of view Φ_k as NumPy functions: what an attacker can work out from poses and the scenario alone.

The same shapes as `trust_env.core.fov`. A pose is (x, y, cos, sin) of position (m) and heading, as
observations give it. Everything is elementwise, so that a world's numbers do not depend on the batch that it
is computed in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from trust_env.parameters import reach_of
from trust_env.scenario import Fov, Scenario
from trust_env.scenario.fov import signed_area

_INSIDE = 1.0 - 1e-6  # a point drawn from an FOV is inside, whatever the rounding


@dataclass(frozen=True)
class Fovs:
    """The FOVs of n agents, each in its agent's own frame (x ahead, y left).

    A circle is a sector that opens all around. A polygon is cut out of the circle that its `reach` spans.
    """

    polygon: np.ndarray  # bool[n]
    reach: np.ndarray  # float[n], m, distance of the farthest point
    axis: np.ndarray  # float[n], rad, middle of the sector
    half_width: np.ndarray  # float[n], rad, half the sector's opening
    corners: np.ndarray  # float[n, V, 2], m, counter-clockwise, the last one repeated
    shares: np.ndarray  # float[n, V - 2], summed areas of the triangles at the first corner, the last one 1
    middle: np.ndarray  # float[n, 2], m, a point well inside

    @classmethod
    def of(cls, scenario: Scenario, agents: np.ndarray) -> Fovs:
        """The FOVs of the given agents."""
        fovs = [scenario.agent(int(k)).fov for k in agents]
        most = max([3, *(len(fov.vertices or ()) for fov in fovs)])
        corners = np.array([_corners(fov, most) for fov in fovs]).reshape(-1, most, 2)
        opening = np.array([_opening(fov) for fov in fovs]).reshape(-1, 2)
        return cls(
            polygon=np.array([fov.type == "polygon" for fov in fovs], dtype=bool),
            reach=np.array([reach_of(fov) for fov in fovs], dtype=np.float64),
            axis=opening[:, 0],
            half_width=opening[:, 1],
            corners=corners,
            shares=_triangle_shares(corners),
            middle=np.array([_middle(fov) for fov in fovs]).reshape(-1, 2),
        )

    def __len__(self) -> int:
        return len(self.reach)

    def contains(self, pose: np.ndarray, points: np.ndarray, margin: float = 0.0) -> np.ndarray:
        """Φ(points), bool[..., n, P], for pose[..., n, 4] and points[..., n, P, 2] (n may be 1: for all).

        With a margin only what stays inside when it moves away from the middle by that share of its distance.
        """
        u, v = _to_local(pose, points)
        if margin:
            middle = self.middle[:, None, :]
            u, v = u + margin * (u - middle[..., 0]), v + margin * (v - middle[..., 1])
        reach, half = self.reach[:, None], self.half_width[:, None]
        inside = u * u + v * v <= reach * reach
        if (self.half_width < np.pi).any():
            off = _wrapped(np.arctan2(v, u) - self.axis[:, None])
            inside &= (np.abs(off) <= half) | (half >= np.pi) | ((u == 0.0) & (v == 0.0))
        if self.polygon.any():
            # Edges of length 0, where there are no more corners, exclude nothing.
            for a in range(self.corners.shape[1]):
                start = self.corners[:, a, None, :]
                edge = self.corners[:, (a + 1) % self.corners.shape[1], None, :] - start
                inside &= edge[..., 0] * (v - start[..., 1]) - edge[..., 1] * (u - start[..., 0]) >= 0.0
        return inside

    def boxes(self, pose: np.ndarray) -> np.ndarray:
        """x_min, x_max, y_min, y_max (m) [..., n, 4] for pose[..., n, 4]: what actions are scaled to."""
        x, y, reach = pose[..., 0], pose[..., 1], self.reach
        box = np.stack([x - reach, x + reach, y - reach, y + reach], axis=-1)
        sector = self.half_width < np.pi
        if sector.any():
            box = np.where(sector[:, None], _box_around(pose, *self._arc(pose)), box)
        if self.polygon.any():
            corners = _box_around(pose, self.corners[..., 0], self.corners[..., 1])
            box = np.where(self.polygon[:, None], corners, box)
        return box

    def _arc(self, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Local u, v [..., n, 6]: the ends of a sector's arc and its outermost points, or the apex."""
        compass = np.arange(4) * (np.pi / 2.0) - np.arctan2(pose[..., 3], pose[..., 2])[..., None]
        axis, half = self.axis[:, None], self.half_width[:, None]
        ends = np.broadcast_to(axis + half * np.array([1.0, -1.0]), (*compass.shape[:-1], 2))
        held = np.abs(_wrapped(compass - axis)) <= half
        held = np.concatenate([np.ones(ends.shape, dtype=bool), held], axis=-1)
        angle, length = np.concatenate([ends, compass], axis=-1), np.where(held, self.reach[:, None], 0.0)
        return length * np.cos(angle), length * np.sin(angle)

    def sample(self, pose: np.ndarray, draws: np.ndarray) -> np.ndarray:
        """Points uniform in the FOVs: [..., n, P, 2] (m), from U[0, 1) draws[..., n, P, 3]."""
        first, second, third = (np.ascontiguousarray(draws[..., i]) for i in range(3))
        distance = _INSIDE * self.reach[:, None] * np.sqrt(first)
        angle = self.axis[:, None] + _INSIDE * self.half_width[:, None] * (2.0 * second - 1.0)
        u, v = distance * np.cos(angle), distance * np.sin(angle)
        if self.polygon.any():
            in_polygon = self._sample_polygon(np.sqrt(first), second, third)
            chosen = self.polygon[:, None]
            u, v = np.where(chosen, in_polygon[..., 0], u), np.where(chosen, in_polygon[..., 1], v)
        return np.stack(_to_global(pose, u, v), axis=-1)

    def _sample_polygon(self, root: np.ndarray, along: np.ndarray, pick: np.ndarray) -> np.ndarray:
        """Local points [..., n, P, 2]: a triangle by area, then a point of it (Osada et al. 2002, Eq. 1)."""
        n = np.arange(len(self))[:, None]
        triangle = (pick[..., None] >= self.shares[:, None, :-1]).sum(axis=-1)  # [..., n, P]
        a, b, c = self.corners[n, 0], self.corners[n, triangle + 1], self.corners[n, triangle + 2]
        root, along = root[..., None], along[..., None]
        point = (1.0 - root) * a + root * (1.0 - along) * b + root * along * c
        middle = self.middle[:, None, :]
        return middle + _INSIDE * (point - middle)


def _opening(fov: Fov) -> tuple[float, float]:
    """Middle and half of the angle that an FOV opens about the agent, rad."""
    return (fov.heading, fov.width / 2.0) if fov.type == "sector" else (0.0, math.pi)


def _middle(fov: Fov) -> tuple[float, float]:
    """A point well inside, m: mean of a polygon's corners; a sector's centroid, 2/3 r sin(h)/h away."""
    if fov.type == "polygon":
        x, y = np.mean(fov.vertices or ((0.0, 0.0),), axis=0)
        return float(x), float(y)
    axis, half = _opening(fov)
    distance = 2.0 / 3.0 * fov.radius * math.sin(half) / half
    return distance * math.cos(axis), distance * math.sin(axis)


def _corners(fov: Fov, most: int) -> np.ndarray:
    """Counter-clockwise corners [most, 2] of a polygon, the last one repeated; zeros for the other shapes."""
    if fov.type != "polygon" or not fov.vertices:
        return np.zeros((most, 2))
    corners = np.array(fov.vertices, dtype=np.float64)
    corners = corners if signed_area(fov.vertices) > 0 else corners[::-1]
    return np.pad(corners, ((0, most - len(corners)), (0, 0)), mode="edge")


def _triangle_shares(corners: np.ndarray) -> np.ndarray:
    """Cumulated shares [n, V - 2] of the fan of triangles at the first corner in a polygon's area."""
    b, c = corners[:, 1:-1] - corners[:, :1], corners[:, 2:] - corners[:, :1]
    summed = np.cumsum(b[..., 0] * c[..., 1] - b[..., 1] * c[..., 0], axis=-1)
    return np.divide(summed, summed[:, -1:], out=np.ones_like(summed), where=summed[:, -1:] > 0.0)


def _wrapped(angle: np.ndarray) -> np.ndarray:
    """Angles in (-π, π]."""
    return np.pi - (np.pi - angle) % (2.0 * np.pi)


def _box_around(pose: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """x_min, x_max, y_min, y_max (m) of local points u, v [..., n, Q]."""
    x, y = _to_global(pose, u, v)
    return np.stack([x.min(axis=-1), x.max(axis=-1), y.min(axis=-1), y.max(axis=-1)], axis=-1)


def _to_local(pose: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x, y, c, s = (pose[..., None, i] for i in range(4))
    dx, dy = points[..., 0] - x, points[..., 1] - y
    return c * dx + s * dy, c * dy - s * dx


def _to_global(pose: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x, y, c, s = (pose[..., None, i] for i in range(4))
    return x + c * u - s * v, y + s * u + c * v
