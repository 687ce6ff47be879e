"""Layers of fields: one over the other, with where each value was written, and single fields set by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trust_env.errors import nearest
from trust_env.scenario_errors import Origins, ScenarioError, shown


@dataclass(frozen=True)
class Layer:
    """The fields of a source over those of its base, and where each was written."""

    fields: dict[str, Any]
    origins: Origins


def merged(below: Any, above: Any) -> Any:
    """Mappings merge deeply, anything else replaces."""
    if not (isinstance(below, Mapping) and isinstance(above, Mapping)):
        return above
    below = _without_other_noise(below, above)
    return {**below, **{k: merged(below[k], v) if k in below else v for k, v in above.items()}}


def _without_other_noise(below: Mapping[str, Any], above: Mapping[str, Any]) -> Mapping[str, Any]:
    # sigma and noise_cov say the same thing: giving one replaces the other.
    for given, other in (("sigma", "noise_cov"), ("noise_cov", "sigma")):
        if above.get(given) is not None and other not in above and other in below:
            return {**below, other: None}
    return below


def absolute_data(fields: Mapping[str, Any], folder: Path) -> None:
    """Make the path of a recording absolute, in place: it is relative to what names it."""
    targets = fields.get("targets")
    if isinstance(targets, dict) and isinstance(targets.get("data"), str):
        targets["data"] = str((folder / Path(targets["data"]).expanduser()).resolve())


def plain(value: Any) -> Any:
    """NumPy numbers and arrays, tuples and paths as YAML could have given them."""
    if isinstance(value, Mapping):
        return {key: plain(v) for key, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, Path):
        return str(value)
    return value.tolist() if hasattr(value, "tolist") else value


def override(layer: Layer, overrides: Mapping[str, Any], defaults: Mapping[str, Any]) -> Layer:
    """Set fields by dotted path, or by a last name that fits one field only; `defaults` has every field."""
    fields, places, problems = layer.fields, dict(layer.origins.places), []
    for key, value in overrides.items():
        location = _location(key, plain(value), defaults)
        if isinstance(location, str):
            problems.append(f"{layer.origins.source}: {key} = {shown(value)} (override): {location}")
            continue
        change = plain(value)
        for name in reversed(location):
            change = {name: change}
        absolute_data(change, Path.cwd())
        fields = merged(fields, change)
        places[location] = ("override", 0)
    if problems:
        raise ScenarioError(problems)
    return Layer(fields, Origins(layer.origins.source, places))


def _location(key: str, value: Any, defaults: Mapping[str, Any]) -> tuple[str, ...] | str:
    """The field that a key means, or what was expected instead."""
    known = dict(_walk(defaults, ()))
    if tuple(key.split(".")) in known:
        return tuple(key.split("."))
    named = [location for location in known if location[-1] == key]
    # `order` is that of the team or that of a metric: the kind of the value tells which.
    fitting = [location for location in named if _same_kind(value, known[location])]
    if len(named) == 1 or len(fitting) == 1:
        return (fitting or named)[0]
    if named:
        return f"several fields have this name; expected one of {', '.join(map('.'.join, named))}"
    return f"unknown field; {_meant(key, known)}"


def _walk(fields: Mapping[str, Any], above: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    for name, value in fields.items():
        yield (*above, name), value
        if isinstance(value, Mapping):
            yield from _walk(value, (*above, name))


def _same_kind(value: Any, default: Any) -> bool:
    kinds = (str, (int, float), (list, tuple), Mapping)
    return (
        value is None
        or default is None
        or any(isinstance(v, k) for k in kinds for v in [value] if isinstance(default, k))
    )


def _meant(key: str, known: Mapping[tuple[str, ...], Any]) -> str:
    full = {name: ".".join(location) for location in known for name in (location[-1], ".".join(location))}
    match = nearest(key, full)
    return (
        f"did you mean {full[match]!r}?"
        if match
        else "expected a field of the scenario, such as tracker.gate"
    )
