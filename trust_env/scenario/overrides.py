"""Layers of fields: one over the other, with where each value was written, and single fields set by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trust_env.errors import nearest
from trust_env.scenario.errors import Location, Origins, Problem, ScenarioError, shown


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
    changes: dict[str, Any] = {}
    problems: list[str] = []
    for key, value in overrides.items():
        location = _location(key, plain(value), defaults)
        if isinstance(location, str):
            problems.append(f"{layer.origins.source}: {key} = {shown(value)} (override): {location}")
        else:
            _set(changes, location, plain(value))
    if problems:
        raise ScenarioError(problems)
    absolute_data(changes, Path.cwd())
    return over(layer, changes, Origins(layer.origins.source, places(changes, "override")))


def over(below: Layer, fields: dict[str, Any], origins: Origins) -> Layer:
    """The layer of `fields`, written where `origins` says, over the one below."""
    visible = {at: place for at, place in below.origins.places.items() if not _hidden(at, fields)}
    return Layer(merged(below.fields, fields), Origins(origins.source, visible | origins.places))


def places(fields: Any, source: str) -> dict[Location, tuple[str, int]]:
    """A place for every field of a mapping that was written in no file."""
    return {location: (source, 0) for location, _ in _walk(fields, ())}


def _set(fields: dict[str, Any], location: tuple[str, ...], value: Any) -> None:
    for name in location[:-1]:
        if not isinstance(fields.get(name), dict):
            fields[name] = {}
        fields = fields[name]
    fields[location[-1]] = value


def _hidden(location: Location, fields: Any) -> bool:
    """Whether what `fields` say replaces the value of the layer below at a location."""
    for name in location:
        if not isinstance(fields, Mapping):
            return True
        if name not in fields:
            return False
        fields = fields[name]
    return not isinstance(fields, Mapping)


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
    kinds = [kind for kind in (str, (int, float), (list, tuple), Mapping) if isinstance(default, kind)]
    return value is None or not kinds or isinstance(value, kinds[0])


def _meant(key: str, known: Mapping[tuple[str, ...], Any]) -> str:
    full = {name: ".".join(location) for location in known for name in (location[-1], ".".join(location))}
    match = nearest(key, full)
    if match is None:
        return f"expected a field, such as {next(name for name in full if '.' in name)}"
    return f"did you mean {full[match]!r}?"


_IDLE_WHEN = {
    ("team", "n_adversaries"): ("agents",),
    ("team", "n_benign"): ("agents",),
    ("team", "order"): ("agents",),
    ("targets", "slots"): ("targets", "positions"),
    ("targets", "velocities"): ("targets", "data"),
}


def refuse_idle(layer: Layer) -> None:
    """Refuse overrides that would change nothing, as the scenario says the same in another field."""
    for location, other in _IDLE_WHEN.items():
        overridden = layer.origins.places.get(location) == ("override", 0)
        value, decided = _at(layer.fields, location), _at(layer.fields, other) is not None
        if overridden and decided and value is not None:
            text = f"{'.'.join(other)} decides this here; override that, or make it null (None)"
            raise layer.origins.error([Problem(location, value, text)])


def _at(fields: Any, location: tuple[str, ...]) -> Any:
    for name in location:
        fields = fields.get(name) if isinstance(fields, Mapping) else None
    return fields
