"""What is wrong with a scenario, told with the file, the field, the value and what was expected."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pydantic import BaseModel, ValidationError

from trust_env.errors import suggestion

Location = tuple[str | int, ...]


class ScenarioError(ValueError):
    """A scenario that cannot be used; `problems` holds one line per problem."""

    def __init__(self, problems: Iterable[str]):
        self.problems = tuple(problems)
        super().__init__("\n".join(self.problems))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (
            self.problems,
        )  # else unpickling in another process would split the text into letters


@dataclass(frozen=True)
class Problem:
    """One field that is wrong: where it stands, what it holds, what was expected there."""

    location: Location
    value: object
    expected: str

    def within(self, prefix: Location) -> Problem:
        return Problem(prefix + self.location, self.value, self.expected)


@dataclass
class Origins:
    """Where each field's value was written: `places[location] = (file, line)`, or ("override", 0)."""

    source: str  # what the user named: a file, a built-in scenario, "dict"
    places: dict[Location, tuple[str, int]] = field(default_factory=dict)

    def describe(self, problem: Problem) -> str:
        """One line: `my.yaml, line 3: tracker.gate = 1.5: expected a number below 1`."""
        value = "" if problem.value is MISSING else f" = {shown(problem.value)}"
        where, note = self._place(problem.location)
        return f"{where}: {dotted(problem.location)}{value}{note}: {problem.expected}"

    def _place(self, location: Location) -> tuple[str, str]:
        known = [location[:n] for n in range(len(location), 0, -1) if location[:n] in self.places]
        file, line = self.places[known[0]] if known else (self.source, 0)
        at_line = f", line {line}" if line else ""
        if file == self.source:
            return f"{file}{at_line}", ""
        return self.source, f" ({file})" if file == "override" else f" (from {file}{at_line})"

    def error(self, problems: Iterable[Problem]) -> ScenarioError:
        return ScenarioError(self.describe(p) for p in problems)


MISSING: typing.Final = object()  # the value of a field that is not there


def dotted(location: Location) -> str:
    """("agents", 0, "fov") -> "agents[0].fov"."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return text.removeprefix(".") or "the scenario"


def shown(value: object) -> str:
    """A value as YAML users know it, cut where it gets long."""
    text = "null" if value is None else repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def problems_of(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Pydantic's findings in our words; a validator of ours hands over its own `problems` as context."""
    found: list[Problem] = []
    for entry in error.errors(include_url=False):
        location, context = tuple(entry["loc"]), entry.get("ctx", {})
        own: Sequence[Problem] = context.get("problems", ())
        found += [p.within(location) for p in own] or [_problem(entry["type"], location, entry, model)]
    return found


def _problem(kind: str, location: Location, entry: Mapping[str, Any], model: type[BaseModel]) -> Problem:
    value, context = entry["input"], entry.get("ctx", {})
    if kind == "extra_forbidden":
        known = _fields_at(model, location[:-1])
        text = f"unknown field; {suggestion(location[-1], known)}expected one of {', '.join(known)}"
        return Problem(location, value, text)
    if kind == "missing":
        return Problem(location, MISSING, "this field is required")
    if kind == "literal_error":
        choices = [c.strip("'") for c in context["expected"].replace(" or ", ", ").split(", ")]
        return Problem(
            location, value, f"expected one of {', '.join(choices)}; {suggestion(value, choices)}".strip("; ")
        )
    template = _EXPECTED.get(kind)
    return Problem(location, value, "expected " + template.format(**context) if template else entry["msg"])


_EXPECTED = {
    "greater_than": "a number above {gt}",
    "greater_than_equal": "a number of at least {ge}",
    "less_than": "a number below {lt}",
    "less_than_equal": "a number of at most {le}",
    "finite_number": "a finite number",
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "string_type": "text",
    "tuple_type": "a list",
    "model_type": "a mapping of fields",
    "model_attributes_type": "a mapping of fields",
    "dict_type": "a mapping of fields",
}


def _fields_at(model: type[BaseModel], location: Location) -> list[str]:
    """The field names of the model that stands at `location` below `model`."""
    current = model
    for part in location:
        if isinstance(part, str):
            current = _model_in(current.model_fields[part].annotation) or current
    return list(current.model_fields)


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The model inside `Model`, `Model | None` or `tuple[Model, ...] | None`."""
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return annotation if issubclass(annotation, BaseModel) else None
    inner = [m for m in map(_model_in, typing.get_args(annotation)) if m]
    return inner[0] if inner else None
