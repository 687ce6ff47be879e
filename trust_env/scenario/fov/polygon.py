"""The FOV with straight edges; the agent itself may stand outside it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.scenario.fov.shape import INSIDE, FovGroup, FovShape, box_around, global_of, local_of
from trust_env.scenario.types import LENGTH

Vertices = tuple[tuple[float, float], ...]


class PolygonGroup(FovGroup):
    """The FOVs of n agents that are convex polygons of at most V corners.

    corners[n, V, 2]: m, counter-clockwise, the last one repeated; fan_area[n, V - 2]: cumulative area of the
    triangles at the first corner, as a fraction of the polygon's; middle[n, 2]: m.
    """

    def __init__(self, shapes: Sequence[Polygon]):
        super().__init__(shapes)
        most = max(len(shape.vertices) for shape in shapes)
        self.corners = np.array([_pad(shape.counterclockwise(), most) for shape in shapes])
        self.fan_area = _cumulative_fan_area(self.corners)
        self.middle = np.array([shape.middle for shape in shapes])

    def contains(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        inside = super().contains(u, v)
        # Edges of length 0, where there are no more corners, exclude nothing.
        for a in range(self.corners.shape[1]):
            start = self.corners[:, a, None, :]
            edge = self.corners[:, (a + 1) % self.corners.shape[1], None, :] - start
            inside &= edge[..., 0] * (v - start[..., 1]) - edge[..., 1] * (u - start[..., 0]) >= 0.0
        return inside

    def boxes(self, pose: np.ndarray) -> np.ndarray:
        return box_around(pose, self.corners[..., 0], self.corners[..., 1])

    def sample(self, draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        # A triangle of the fan by area, then a point of it (Osada et al. 2002, Eq. 1).
        root, along, pick = np.sqrt(draws[..., 0]), draws[..., 1], draws[..., 2]
        n = np.arange(len(self.corners))[:, None]
        triangle = (pick[..., None] >= self.fan_area[:, None, :-1]).sum(axis=-1)  # [..., n, P]
        a, b, c = self.corners[n, 0], self.corners[n, triangle + 1], self.corners[n, triangle + 2]
        root, along = root[..., None], along[..., None]
        point = (1.0 - root) * a + root * (1.0 - along) * b + root * along * c
        middle = self.middle[:, None, :]
        point = middle + INSIDE * (point - middle)
        return point[..., 0], point[..., 1]


@dataclass(frozen=True)
class Polygon(FovShape):
    """A convex polygon."""

    group = PolygonGroup

    vertices: Vertices = ()  # m, corners in order around it, in either orientation

    def faults(self) -> dict[str, str]:
        expected = _expected_vertices(self.vertices)
        return {"vertices": expected} if expected else {}

    @property
    def area(self) -> float:
        return abs(signed_area(self.vertices))

    @property
    def reach(self) -> float:
        return max(math.hypot(x, y) for x, y in self.vertices)

    @property
    def middle(self) -> tuple[float, float]:
        """m, mean of the corners."""
        x, y = np.mean(self.vertices, axis=0)
        return float(x), float(y)

    def counterclockwise(self) -> np.ndarray:
        """Corners [V, 2], m."""
        corners = np.array(self.vertices, dtype=np.float64)
        return corners if signed_area(self.vertices) > 0 else corners[::-1]

    @property
    def numbers(self) -> list[float]:
        """How many corners, then x, y (m) of each, counter-clockwise."""
        return [len(self.vertices), *self.counterclockwise().ravel().tolist()]

    def outline(self, pose: np.ndarray) -> np.ndarray:
        c, s = math.cos(pose[2]), math.sin(pose[2])
        return pose[:2] + np.asarray(self.vertices, dtype=np.float64) @ np.array([[c, s], [-s, c]])

    @staticmethod
    @kernel
    def holds(fov, frame, x, y):
        u, v = local_of(frame, x, y)
        for a in range(int(fov[0])):
            if _to_the_left(fov, a, u, v) < 0.0:
                return False
        return True

    @staticmethod
    @kernel
    def nearest_inside(fov, reach, frame, x, y):
        """On the segment to the middle of the corners, just behind where it enters."""
        u, v = local_of(frame, x, y)
        sides, middle_u, middle_v, fraction = int(fov[0]), 0.0, 0.0, 1.0
        for a in range(sides):
            middle_u += fov[1 + 2 * a] / sides
            middle_v += fov[2 + 2 * a] / sides
        for a in range(sides):
            outside = _to_the_left(fov, a, u, v)
            if outside < 0.0:
                inside = _to_the_left(fov, a, middle_u, middle_v)
                fraction = min(fraction, inside / (inside - outside))
        fraction *= INSIDE
        return global_of(frame, middle_u + fraction * (u - middle_u), middle_v + fraction * (v - middle_v))

    @staticmethod
    @kernel
    def box(fov, reach, frame):
        return _box(fov, frame)

    @staticmethod
    @kernel
    def edge(fov, reach, frame, x, y):
        u, v = local_of(frame, x, y)
        margin, nu, nv = np.inf, 0.0, 0.0
        for a in range(int(fov[0])):
            b = a + 1 if a + 1 < int(fov[0]) else 0
            eu, ev = fov[1 + 2 * b] - fov[1 + 2 * a], fov[2 + 2 * b] - fov[2 + 2 * a]
            length = math.hypot(eu, ev)
            inside = _to_the_left(fov, a, u, v) / length
            if inside < margin:
                margin, nu, nv = inside, -ev / length, eu / length
        return margin, frame[3] * nu - frame[4] * nv, frame[4] * nu + frame[3] * nv

    @staticmethod
    @kernel
    def candidate(fov, reach, frame, first, second):
        """In the box around it, of which a turned triangle fills an eighth at least."""
        x0, x1, y0, y1 = _box(fov, frame)
        return x0 + first * (x1 - x0), y0 + second * (y1 - y0)


@kernel
def _box(fov, frame):
    x0, x1, y0, y1 = np.inf, -np.inf, np.inf, -np.inf
    for a in range(int(fov[0])):
        x, y = global_of(frame, fov[1 + 2 * a], fov[2 + 2 * a])
        x0, x1, y0, y1 = min(x0, x), max(x1, x), min(y0, y), max(y1, y)
    return x0, x1, y0, y1


@kernel
def _to_the_left(fov, a, u, v):
    """How far to the left of edge a a point lies, times the edge's length."""
    b = a + 1 if a + 1 < int(fov[0]) else 0
    eu, ev = fov[1 + 2 * b] - fov[1 + 2 * a], fov[2 + 2 * b] - fov[2 + 2 * a]
    return eu * (v - fov[2 + 2 * a]) - ev * (u - fov[1 + 2 * a])


def signed_area(vertices: Vertices) -> float:
    """m^2 by the shoelace formula, positive when the vertices run counter-clockwise."""
    following = vertices[1:] + vertices[:1]
    return sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in zip(vertices, following)) / 2


def _expected_vertices(vertices: Vertices) -> str:
    """What the vertices, in either orientation, lack of a convex polygon; empty when they are one."""
    if len(vertices) < 3:
        return "expected at least 3 vertices [x, y], or the FOV sees nothing"
    edges = [(x1 - x0, y1 - y0) for (x0, y0), (x1, y1) in zip(vertices, vertices[1:] + vertices[:1])]
    if (0.0, 0.0) in edges:
        return "expected vertices that differ from their neighbours"
    if max(math.hypot(*edge) for edge in edges) < LENGTH.least:
        return f"expected an edge of at least {LENGTH.least:g} m, or the FOV sees nothing"
    if abs(signed_area(vertices)) < 1e-12 * max(math.hypot(*edge) for edge in edges) ** 2:
        return "expected vertices that enclose an area above 0, or the FOV sees nothing"
    turns = [_exterior_angle(a, b) for a, b in zip(edges, edges[1:] + edges[:1])]
    one_way = all(t >= -1e-9 for t in turns) or all(t <= 1e-9 for t in turns)
    # A star turns one way at every corner too, but goes around more than once.
    convex = one_way and math.isclose(abs(sum(turns)), 2 * math.pi, rel_tol=1e-6)
    return "" if convex else "expected the corners of a convex polygon, in order around it"


def _exterior_angle(a: tuple[float, float], b: tuple[float, float]) -> float:
    """rad, between two edges."""
    return math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])


def _pad(corners: np.ndarray, most: int) -> np.ndarray:
    """Corners [most, 2], the last one repeated."""
    return np.pad(corners, ((0, most - len(corners)), (0, 0)), mode="edge")


def _cumulative_fan_area(corners: np.ndarray) -> np.ndarray:
    """Fractions [n, V - 2] of the polygons' areas, summed over the triangles at the first corner."""
    b, c = corners[:, 1:-1] - corners[:, :1], corners[:, 2:] - corners[:, :1]
    summed = np.cumsum(b[..., 0] * c[..., 1] - b[..., 1] * c[..., 0], axis=-1)
    return summed / summed[:, -1:]
