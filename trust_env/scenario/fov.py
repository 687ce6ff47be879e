"""Fields of view: circle, sector and convex polygon about an agent."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import model_validator

from trust_env.scenario.errors import Problem
from trust_env.scenario.types import Part, Point, Real, refuse

FovType = Literal["circle", "sector", "polygon"]
Vertices = tuple[tuple[float, float], ...]


class Fov(Part):
    """Field of view about the agent; only the fields of its `type` count."""

    type: FovType
    radius: Real  # m
    heading: Real  # rad, middle of the sector, from the agent's own heading
    width: Real  # rad, total opening of the sector
    vertices: tuple[Point, ...] | None  # m, in the agent's frame: x ahead, y left

    @model_validator(mode="after")
    def _sees_something(self) -> Fov:
        problems: list[Problem] = []
        if self.type != "polygon" and self.radius <= 0:
            text = "expected a number above 0, or the FOV sees nothing"
            problems.append(Problem(("radius",), self.radius, text))
        if self.type == "sector" and not 0 < self.width <= 2 * math.pi:
            text = "expected radians above 0, or the FOV sees nothing, and at most 2 pi (6.283185307179586)"
            problems.append(Problem(("width",), self.width, text))
        if self.type == "polygon" and (fault := polygon_fault(self.vertices or ())):
            problems.append(Problem(("vertices",), self.vertices, fault))
        refuse(problems)
        return self

    @property
    def area(self) -> float:
        """m^2; the expected clutter of a scan is its density times this."""
        if self.type == "polygon":
            return abs(signed_area(self.vertices or ()))
        opening = self.width if self.type == "sector" else 2 * math.pi
        return opening * self.radius**2 / 2


def signed_area(vertices: Vertices) -> float:
    """m^2 by the shoelace formula, positive when the vertices run counter-clockwise."""
    following = vertices[1:] + vertices[:1]
    return sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in zip(vertices, following)) / 2


def polygon_fault(vertices: Vertices) -> str:
    """Why the vertices, in either orientation, enclose no convex polygon; empty when they do."""
    if len(vertices) < 3:
        return "expected at least 3 vertices [x, y], or the FOV sees nothing"
    edges = [(x1 - x0, y1 - y0) for (x0, y0), (x1, y1) in zip(vertices, vertices[1:] + vertices[:1])]
    if (0.0, 0.0) in edges:
        return "expected vertices that differ from their neighbours"
    if abs(signed_area(vertices)) < 1e-12 * max(math.hypot(*edge) for edge in edges) ** 2:
        return "expected vertices that enclose an area above 0, or the FOV sees nothing"
    turns = [_turn(a, b) for a, b in zip(edges, edges[1:] + edges[:1])]
    one_way = all(t >= -1e-9 for t in turns) or all(t <= 1e-9 for t in turns)
    # A star turns one way at every corner too, but goes around more than once.
    convex = one_way and math.isclose(abs(sum(turns)), 2 * math.pi, rel_tol=1e-6)
    return "" if convex else "expected the corners of a convex polygon, in order around it"


def _turn(a: tuple[float, float], b: tuple[float, float]) -> float:
    """rad, the exterior angle between two edges."""
    return math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])
