"""Layers of fields, each with where it was written, and one merged over the other."""

from __future__ import annotations

import functools
import types
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trust_env.files import expanded
from trust_env.scenario.errors import Location, Origin, Origins


@dataclass(frozen=True)
class Layer:
    """Some or all fields, nested as in YAML, and where each was written."""

    fields: dict[str, Any]
    origins: Origins


def merge_layers(layers: Sequence[Layer]) -> Layer:
    """One layer of all fields; the layers are given from the lowest to the one that has the last word."""
    return functools.reduce(_merge_two, layers)


def _merge_two(below: Layer, above: Layer) -> Layer:
    visible = {at: o for at, o in below.origins.by_location.items() if not _is_replaced(at, above.fields)}
    origins = Origins(above.origins.source, visible | above.origins.by_location)
    return Layer(_merge_fields(below.fields, above.fields), origins)


def _merge_fields(below: Any, above: Any) -> Any:
    """Mappings merge deeply, anything else replaces."""
    if not (isinstance(below, Mapping) and isinstance(above, Mapping)):
        return above
    below = _without_other_noise(below, above)
    return {**below, **{k: _merge_fields(below[k], v) if k in below else v for k, v in above.items()}}


def _without_other_noise(below: Mapping[str, Any], above: Mapping[str, Any]) -> Mapping[str, Any]:
    # sigma and noise_cov say the same thing: giving one replaces the other.
    for given, other in (("sigma", "noise_cov"), ("noise_cov", "sigma")):
        if above.get(given) is not None and other not in above and other in below:
            return {**below, other: None}
    return below


def _is_replaced(location: Location, above: Any) -> bool:
    """Whether the fields above replace the value at a location below."""
    for name in location:
        if not isinstance(above, Mapping):
            return True
        if name not in above:
            return False
        above = above[name]
    return not isinstance(above, Mapping)


def value_at(fields: Any, location: Location) -> Any:
    """The value at a location, None where there is no such field."""
    for name in location:
        fields = fields.get(name) if isinstance(fields, Mapping) else None
    return fields


def with_defaults(
    fields: Mapping[Any, Any],
    at: Iterable[Location],
    defaults: Mapping[Any, Any],
    entry_defaults: Mapping[Any, Mapping[str, Any]] = types.MappingProxyType({}),
) -> dict[str, Any]:
    """The fields, those at some locations as the defaults have them; what these do not have is left out.

    entry_defaults: of the entries of lists, by the name of the list.
    """
    changed = dict(fields)
    for name in dict.fromkeys(location[0] for location in at if location):
        deeper = [location[1:] for location in at if location and location[0] == name]
        inner: Any = changed.pop(name, None)
        default: Any = defaults.get(name)
        if isinstance(inner, list) and () not in deeper:
            changed[name] = _with_entries(inner, deeper, entry_defaults.get(name, {}))
        elif isinstance(inner, Mapping) and () not in deeper:
            changed[name] = with_defaults(inner, deeper, default if isinstance(default, Mapping) else {})
        elif name in defaults:
            changed[name] = default
    return changed


def _with_entries(entries: list[Any], at: Iterable[Location], default: Mapping[str, Any]) -> list[Any]:
    """The entries of a list, their fields at some locations as the default entry has them."""
    changed = list(entries)
    for i in {location[0] for location in at if isinstance(location[0], int) and location[0] < len(entries)}:
        below = [location[1:] for location in at if location[0] == i]
        if () in below and default:
            changed[i] = dict(default)
        elif isinstance(entries[i], Mapping):
            changed[i] = with_defaults(entries[i], below, default)
    return changed


def walk(fields: Mapping[str, Any], above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Location and value of every field, at all depths."""
    for name, value in fields.items():
        yield (*above, name), value
        if isinstance(value, Mapping):
            yield from walk(value, (*above, name))


def locations(fields: Mapping[str, Any], source: str) -> dict[Location, Origin]:
    """The origin of every field of a mapping that was written in no file."""
    return {location: (source, 0) for location, _ in walk(fields)}


def to_builtin(value: Any) -> Any:
    """NumPy numbers and arrays, tuples and paths as the built-in types that YAML has."""
    if isinstance(value, Mapping):
        return {key: to_builtin(v) for key, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_builtin(v) for v in value]
    if isinstance(value, Path):
        return str(value)
    return value.tolist() if hasattr(value, "tolist") else value


def absolute_data(fields: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The fields with the path of the recording absolute: it is relative to the folder of what names it."""
    data = value_at(fields, ("targets", "data"))
    if not isinstance(data, str):
        return fields
    try:
        path = str((folder / expanded(data)).resolve())
    except (OSError, RuntimeError, ValueError):
        return fields  # no path: whoever opens it says so
    return {**fields, "targets": {**fields["targets"], "data": path}}
