"""Field of view about an agent: one file per shape, and the registry of them."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Literal

from pydantic import model_validator

from trust_env.scenario.errors import Problem
from trust_env.scenario.fov.circle import Circle
from trust_env.scenario.fov.polygon import Polygon
from trust_env.scenario.fov.sector import Sector
from trust_env.scenario.fov.shape import FovShape
from trust_env.scenario.types import Angle, Coordinate, Part, Points, raise_problems

# What a new shape needs beside its file: a line here, and fields that no other shape has in the models below.
SHAPES: dict[str, type[FovShape]] = {"circle": Circle, "sector": Sector, "polygon": Polygon}

if TYPE_CHECKING:
    FovType = str  # type checkers do not look into the registry
else:
    FovType = Literal[tuple(SHAPES)]


class Fov(Part):
    """Field of view about the agent; only the fields that the shape of its `type` has count."""

    type: FovType
    radius: Coordinate  # m
    heading: Angle  # rad, middle of the sector, from the agent's own heading
    width: Angle  # rad, total opening of the sector
    vertices: Points | None  # m, in the agent's frame: x ahead, y left

    @model_validator(mode="after")
    def _sees_something(self) -> Fov:
        faults = self.shape.faults()
        raise_problems([Problem((name,), getattr(self, name), text) for name, text in faults.items()])
        return self

    @property
    def shape(self) -> FovShape:
        """The geometry, from the fields that count; what is null is left to the shape."""
        kind = SHAPES[self.type]
        fields = {field.name: getattr(self, field.name) for field in dataclasses.fields(kind)}
        return kind(**{name: value for name, value in fields.items() if value is not None})

    @property
    def area(self) -> float:
        """m^2; the expected clutter of a scan is its density times this."""
        return self.shape.area

    @property
    def reach(self) -> float:
        """m, distance of the farthest point from the agent."""
        return self.shape.reach


class FovDifference(Part):
    """Fields that differ from the scenario's `fov`; null: the same."""

    type: FovType | None = None
    radius: Coordinate | None = None
    heading: Angle | None = None
    width: Angle | None = None
    vertices: Points | None = None
