"""Overrides: single fields, given by dotted path or by last name, as a layer."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from trust_env.errors import nearest
from trust_env.scenario.errors import OVERRIDE, Origins, ScenarioError, format_value
from trust_env.scenario.layers import Layer, absolute_data, locations, to_builtin, walk

Fields = Mapping[str, Any]


def override_layer(overrides: Fields, defaults: Fields, source: str) -> Layer:
    """The layer that sets fields by dotted path, or by a last name that fits one field only.

    `defaults` has every field there is; `source` is what is overridden, for messages.
    """
    fields: dict[str, Any] = {}
    problems: list[str] = []
    for key, value in to_builtin(overrides).items():
        location = _locate(key, value, defaults)
        if isinstance(location, str):
            problems.append(f"{source}: {key} = {format_value(value)} ({OVERRIDE}): {location}")
        else:
            _set(fields, location, value)
    if problems:
        raise ScenarioError(problems)
    fields = absolute_data(fields, Path.cwd())
    return Layer(fields, Origins(source, locations(fields, OVERRIDE)))


def _set(fields: dict[str, Any], location: tuple[str, ...], value: Any) -> None:
    for name in location[:-1]:
        if not isinstance(fields.get(name), dict):
            fields[name] = {}
        fields = fields[name]
    fields[location[-1]] = value


def _locate(key: str, value: Any, defaults: Fields) -> tuple[str, ...] | str:
    """The location that a key names, or what was expected instead."""
    known = dict(walk(defaults))
    if tuple(key.split(".")) in known:
        return tuple(key.split("."))
    named = [location for location in known if location[-1] == key]
    # `order` is that of the team or that of a metric: the kind of the value tells which.
    fitting = [location for location in named if _same_kind(value, known[location])]
    if len(named) == 1 or len(fitting) == 1:
        return (fitting or named)[0]
    if named:
        return f"several fields have this name; expected one of {', '.join(map('.'.join, named))}"
    return f"unknown field; {_suggest_field(key, known)}"


def _same_kind(value: Any, default: Any) -> bool:
    kinds = [kind for kind in (str, (int, float), (list, tuple), Mapping) if isinstance(default, kind)]
    return value is None or not kinds or isinstance(value, kinds[0])


def _suggest_field(key: str, known: Mapping[tuple[str, ...], Any]) -> str:
    full = {name: ".".join(location) for location in known for name in (location[-1], ".".join(location))}
    match = nearest(key, full)
    if match is None:
        return f"expected a field, such as {next(name for name in full if '.' in name)}"
    return f"did you mean {full[match]!r}?"
