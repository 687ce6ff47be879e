"""Errors of scenarios: the file, the line, the field, the value and what was expected."""

from __future__ import annotations

import typing
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from pydantic import BaseModel, ValidationError

from trust_env.errors import suggestion

Location = tuple[str | int, ...]  # the path to a field: ("agents", 0, "fov")
Origin = tuple[str, int]  # where a field was written: file and line, or what is no file and 0
MISSING: Final = object()  # the value of a field that is not there
OVERRIDE: Final = "override"  # the origin of fields that an override sets


class ScenarioError(ValueError):
    """An unusable scenario; `problems` has a line for everything that is wrong."""

    def __init__(self, problems: Iterable[str]):
        self.problems = tuple(problems)
        super().__init__("\n".join(self.problems))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.problems,)  # else a copy would iterate over the characters of the message


@dataclass(frozen=True)
class Problem:
    """One field that is wrong: its location, its value, what was expected, and the fields that say so."""

    location: Location
    value: object
    expected: str
    judged_by: tuple[Location, ...] = ()

    def within(self, above: Location) -> Problem:
        judged_by = tuple(above + location for location in self.judged_by)
        return Problem(above + self.location, self.value, self.expected, judged_by)

    @property
    def fields(self) -> tuple[Location, ...]:
        """The field that is wrong, and those that say so."""
        return (self.location, *self.judged_by)

    def concerns(self, locations: Iterable[Location]) -> bool:
        """Whether any of these fields, or a part of one, is wrong here, or says so."""
        return any(_overlap(mine, other) for mine in self.fields for other in locations)


def _overlap(a: Location, b: Location) -> bool:
    """Whether one of two fields holds the other."""
    shorter = min(len(a), len(b))
    return a[:shorter] == b[:shorter]


@dataclass(frozen=True)
class Origins:
    """Where each field was written; what is not listed was written with the mapping or list that holds it."""

    source: str  # what the user named: a file, a built-in scenario, "mapping"
    by_location: dict[Location, Origin] = field(default_factory=dict)

    @classmethod
    def in_file(cls, source: str, file: str, lines: Mapping[Location, int]) -> Origins:
        return cls(source, {location: (file, line) for location, line in lines.items()})

    def error(self, problems: Iterable[Problem]) -> ScenarioError:
        return ScenarioError(self.format(problem) for problem in problems)

    def describe(self, location: Location) -> str:
        """`my.yaml, line 3`, or the source alone where the field was written elsewhere."""
        file, line = self._origin_of(location)
        return f"{file}, line {line}" if line and file == self.source else self.source

    def format(self, problem: Problem) -> str:
        """One line: `my.yaml, line 3: tracker.gate = 1.5: expected a number below 1`."""
        at = problem.location
        value = "" if problem.value is MISSING else f" = {format_value(problem.value)}"
        file, line = self._origin_of(at)
        elsewhere = f" (from {file}, line {line})" if line else f" ({file})"
        note = "" if file == self.source else elsewhere
        return f"{self.describe(at)}: {dotted(at)}{value}{note}: {problem.expected}"

    def _origin_of(self, location: Location) -> Origin:
        above = (location[:n] for n in range(len(location), 0, -1))
        return next((self.by_location[at] for at in above if at in self.by_location), (self.source, 0))


def dotted(location: Location) -> str:
    """("agents", 0, "fov") -> "agents[0].fov"."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return text.removeprefix(".")


def format_value(value: object) -> str:
    """A value as messages show it, cut where it gets long."""
    try:
        text = "null" if value is None else repr(_tuples_to_lists(value))
    except ValueError:  # Python does not write such numbers
        text = "a number of more than 4300 digits"
    return text if len(text) <= 200 else f"{text[:197]}..."


def _tuples_to_lists(value: object) -> object:
    return [_tuples_to_lists(v) for v in value] if isinstance(value, (list, tuple)) else value


def problems_of(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """A validation error as problems; those that our own validators raise come as its context."""
    problems: list[Problem] = []
    for entry in error.errors(include_url=False):
        at = tuple(entry["loc"])
        own: Iterable[Problem] = entry.get("ctx", {}).get("problems", ())
        problems += [problem.within(at) for problem in own] or [_problem(at, entry, model)]
    return problems


def _problem(at: Location, entry: Mapping[str, Any], model: type[BaseModel]) -> Problem:
    kind, context = entry["type"], entry.get("ctx", {})
    if kind == "missing":
        return Problem(at, MISSING, "this field is required")
    if kind == "extra_forbidden":
        known = _fields_at(model, at[:-1])
        hint = suggestion(at[-1], known)
        return Problem(at, entry["input"], f"unknown field; {hint}expected one of {', '.join(known)}")
    if kind == "literal_error":
        choices = context["expected"].replace("'", "").replace(" or ", ", ")
        hint = suggestion(entry["input"], choices.split(", "))
        return Problem(at, entry["input"], f"{hint}expected one of {choices}")
    template = _EXPECTED.get(kind)
    return Problem(at, entry["input"], f"expected {template.format(**context)}" if template else entry["msg"])


_EXPECTED = {
    "greater_than": "a number above {gt}",
    "greater_than_equal": "a number of at least {ge}",
    "less_than": "a number below {lt}",
    "less_than_equal": "a number of at most {le}",
    "finite_number": "a finite number",
    "int_from_float": "a whole number",
    "string_type": "text",
    "tuple_type": "a list",
    "too_long": "a list of at most {max_length} items",
    "string_too_long": "text of at most {max_length} characters",
    "model_type": "a mapping of fields",
    "invalid_key": "the name of a field",
}


def _fields_at(model: type[BaseModel], location: Location) -> list[str]:
    """The field names of the model at a location below `model`."""
    for name in location:
        if isinstance(name, str):
            model = _model_in(model.model_fields[name].annotation) or model
    return list(model.model_fields)


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The model in `Model`, `Model | None` or `tuple[Model, ...] | None`."""
    inner = typing.get_args(annotation)
    if inner:
        return next((model for model in map(_model_in, inner) if model), None)
    return annotation if isinstance(annotation, type) and issubclass(annotation, BaseModel) else None
