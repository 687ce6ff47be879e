"""Types of the values in scenarios: numbers are finite; text and booleans do not count as numbers."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError

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


def list_of(count: int, content: str) -> BeforeValidator:
    """A validator that accepts lists of `count` items; the error names their `content`."""
    expected = f"expected a list of {count} {content}"

    def check(value: Any) -> Any:
        if not isinstance(value, (list, tuple)) or len(value) != count:
            raise PydanticCustomError("list_of", "{expected}", {"expected": expected})
        return value

    return BeforeValidator(check)


Real = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Positive = Annotated[Real, Field(gt=0)]
NonNegative = Annotated[Real, Field(ge=0)]
Probability = Annotated[Real, Field(ge=0, le=1)]
OpenProbability = Annotated[Real, Field(gt=0, lt=1)]
DetectionProbability = Annotated[Real, Field(gt=0, le=1)]
Whole = Annotated[int, BeforeValidator(_number)]
Count = Annotated[Whole, Field(ge=0)]
Size = Annotated[Whole, Field(ge=1)]
Point = Annotated[tuple[Real, Real], list_of(2, "numbers [x, y]")]
Area = Annotated[tuple[Real, Real, Real, Real], list_of(4, "numbers [x_min, x_max, y_min, y_max]")]
Covariance = Annotated[tuple[Point, Point], list_of(2, "rows [[xx, xy], [xy, yy]]")]
Range = Annotated[tuple[NonNegative, NonNegative], list_of(2, "numbers [min, max]")]
