"""Types of the values in scenarios: numbers are finite; text and booleans do not count as numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from trust_env.scenario.errors import Problem


class Part(BaseModel):
    """A mapping of `builtin/base.yaml`: unknown fields are errors, and nothing changes after loading."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def raise_problems(problems: list[Problem]) -> None:
    """Raise what a validator found, if anything; `errors.problems_of` unpacks it."""
    if problems:
        raise PydanticCustomError("inconsistent", "inconsistent fields", {"problems": problems})


def _number(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise PydanticCustomError("number", "expected a number")
    return value


def _to_float(value: Any) -> float:
    try:
        return float(_number(value))
    except OverflowError:  # a whole number that no float can hold
        return math.inf if value > 0 else -math.inf


def list_of(count: int, content: str) -> BeforeValidator:
    """A validator that accepts lists of `count` items; the error names their `content`."""
    expected = f"expected a list of {count} {content}"

    def check(value: Any) -> Any:
        if not isinstance(value, (list, tuple)) or len(value) != count:
            raise PydanticCustomError("list_of", "{expected}", {"expected": expected})
        return value

    return BeforeValidator(check)


@dataclass(frozen=True)
class Within:
    """A validator for numbers from `least` to `most` (`below`: without that number itself)."""

    least: float
    most: float
    below: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_after_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return handler(schema) | {"minimum": self.least, "exclusiveMaximum" if self.below else "maximum": self.most}

    def _check(self, value: float) -> float:
        if not self.least <= value <= self.most or (self.below and value == self.most):
            raise PydanticCustomError("within", "{expected}", {"expected": f"expected {self}"})
        return value

    def __str__(self) -> str:
        """Such as `a number from 0 to 1`."""
        if isinstance(self.most, int):
            return f"a whole number from {self.least} to {self.most}"
        return f"a number from {self.least:g} to {'below ' if self.below else ''}{self.most:g}"


# The draws of a scan are numbered with 24 bits: 6 of the agent, and 16 of the target, or 12 of the detection and 6 of
# the attempt to place it.
MAX_AGENTS, MAX_TARGETS, MAX_DETECTIONS = 2**6, 2**16, 2**12
MAX_ITEMS = 5_000  # of a list

# What numbers may be: from the bench to beyond the orbit of the moon, and so that no product of them overflows.
LENGTH = Within(1e-6, 1e9)  # m
DURATION = Within(1e-6, 1e6)  # s
VARIANCE = Within(1e-12, 1e18)  # m^2, or (m/s)^2
DENSITY = Within(1e-30, 1e15)  # per m^2

_Float = Annotated[float, BeforeValidator(_to_float)]
Real = Annotated[float, BeforeValidator(_to_float), Field(allow_inf_nan=False)]
Positive = Annotated[Real, Field(gt=0)]
NonNegative = Annotated[Real, Field(ge=0)]
Probability = Annotated[_Float, Within(0.0, 1.0)]
OpenProbability = Annotated[_Float, Within(1e-15, 1.0, below=True)]
DetectionProbability = Annotated[_Float, Within(1e-15, 1.0)]
Length = Annotated[_Float, LENGTH]
Coordinate = Annotated[_Float, Within(-LENGTH.most, LENGTH.most)]  # m, or m/s
Speed = Annotated[_Float, Within(0.0, LENGTH.most)]  # m/s
Duration = Annotated[_Float, DURATION]
Angle = Annotated[_Float, Within(-1e6, 1e6)]  # rad
Variance = Annotated[_Float, VARIANCE]
ProcessNoise = Annotated[_Float, Within(0.0, 1e9)]  # m^2/s^3
Density = Annotated[_Float, DENSITY]
DensityOrNone = Annotated[_Float, Within(0.0, DENSITY.most)]
BirthDensity = Annotated[_Float, Within(1e-36, DENSITY.most)]
Nats = Annotated[_Float, Within(1e-9, 1e9)]
Weight = Annotated[_Float, Within(-1e9, 1e9)]
Order = Annotated[_Float, Within(1.0, 30.0)]  # 30: the power of the greatest length is finite
Whole = Annotated[int, BeforeValidator(_number)]
Count = Annotated[Whole, Within(0, MAX_DETECTIONS)]
Size = Annotated[Whole, Field(ge=1)]
Frames = Annotated[Whole, Within(1, 10**9)]
AgentCount = Annotated[Whole, Within(0, MAX_AGENTS)]
TargetCount = Annotated[Whole, Within(0, MAX_TARGETS)]
DetectionCount = Annotated[Whole, Within(1, MAX_DETECTIONS)]
TrackCount = Annotated[Whole, Within(1, 2**16)]
Point = Annotated[tuple[Coordinate, Coordinate], list_of(2, "numbers [x, y]")]
Points = Annotated[tuple[Point, ...], Field(max_length=MAX_ITEMS)]
Area = Annotated[
    tuple[Coordinate, Coordinate, Coordinate, Coordinate], list_of(4, "numbers [x_min, x_max, y_min, y_max]")
]
CovarianceEntry = Annotated[_Float, Within(-VARIANCE.most, VARIANCE.most)]
CovarianceRow = Annotated[tuple[CovarianceEntry, CovarianceEntry], list_of(2, "numbers [xx, xy]")]
Covariance = Annotated[tuple[CovarianceRow, CovarianceRow], list_of(2, "rows [[xx, xy], [xy, yy]]")]
SpeedRange = Annotated[tuple[Speed, Speed], list_of(2, "numbers [min, max]")]
