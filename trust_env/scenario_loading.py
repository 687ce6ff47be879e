"""From YAML files, dicts and overrides to one mapping with every field, and where each value was written."""

from __future__ import annotations

import copy
import functools
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, TypeAdapter, ValidationError

from trust_env.errors import suggestion, unknown_name
from trust_env.scenario_errors import Location, Origins, Problem, ScenarioError, shown
from trust_env.spec import parse
from trust_env.yaml_lines import read_yaml

_YAML_SOURCE = re.compile(r"(?P<path>.*\.ya?ml)\s*(?P<call>\(.*\))?", re.DOTALL | re.IGNORECASE)
_BUILT_IN = resources.files("trust_env") / "scenarios"


@dataclass
class Layer:
    """The fields of a source merged over those of its base."""

    fields: dict[str, Any]
    origins: Origins


def scenarios() -> tuple[str, ...]:
    """The names of the built-in scenarios."""
    names = (Path(entry.name) for entry in _BUILT_IN.iterdir())
    return tuple(sorted(n.stem for n in names if n.suffix == ".yaml" and n.stem != "base"))


def read_source(source: str | Path | Mapping[str, Any], model: type[BaseModel]) -> Layer:
    """All fields of a source: its own over its base's, down to `base.yaml`."""
    if isinstance(source, Mapping):
        return _over_base(plain(source), Origins("dict"), Path.cwd(), (), model)
    return _named(str(source), Path.cwd(), (), model)


def _named(source: str, folder: Path, chain: tuple[str, ...], model: type[BaseModel]) -> Layer:
    """A built-in name or a path, either with overrides in brackets."""
    as_file = _YAML_SOURCE.fullmatch(source.strip())
    if as_file:
        path = folder / Path(as_file["path"]).expanduser()
        layer = _file(path, as_file["path"], chain, model)
        overrides = parse("scenario" + (as_file["call"] or "")).params
    else:
        spec = parse(source)
        if spec.path is not None or spec.name not in (*scenarios(), "base"):
            raise _unknown_scenario(source, spec.name)
        layer, overrides = _built_in(spec.name, chain, model), spec.params
    return apply_overrides(layer, overrides, model)


def _unknown_scenario(source: str, name: str) -> ScenarioError:
    return ScenarioError([f"{unknown_name('scenario', name, scenarios())}; a file's name ends in .yaml (given: {source!r})"])


def _file(path: Path, shown_path: str, chain: tuple[str, ...], model: type[BaseModel]) -> Layer:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ScenarioError([f"{shown_path}: expected a YAML file in UTF-8"]) from None
    except OSError as fault:
        reason = "there is no such file" if isinstance(fault, FileNotFoundError) else str(fault.strerror)
        raise ScenarioError([f"{shown_path}: {reason}; expected a YAML file (in {path.parent.resolve()})"]) from None
    key = str(path.resolve())
    if key in chain:
        names = " -> ".join(os.path.basename(p) for p in (*chain[chain.index(key) :], key))
        raise ScenarioError([f"{shown_path}: base: the files name each other in a circle: {names}"])
    fields, lines = read_yaml(text, shown_path)
    fields.setdefault("name", path.stem)
    origins = Origins(shown_path, {location: (shown_path, line) for location, line in lines.items()})
    return _over_base(fields, origins, path.parent, (*chain, key), model)


@functools.cache
def _packaged(name: str) -> tuple[dict[str, Any], dict[Location, int]]:
    return read_yaml((_BUILT_IN / f"{name}.yaml").read_text(encoding="utf-8"), name)


def _built_in(name: str, chain: tuple[str, ...], model: type[BaseModel]) -> Layer:
    fields, lines = _packaged(name)
    file = f"{name}.yaml"
    origins = Origins(name, {location: (file, line) for location, line in lines.items()})
    if name == "base":
        return Layer(copy.deepcopy(fields), origins)
    return _over_base(copy.deepcopy(fields), origins, Path.cwd(), chain, model)


def _over_base(fields: dict[str, Any], origins: Origins, folder: Path, chain: tuple[str, ...], model: type[BaseModel]) -> Layer:
    base = fields.pop("base", "base")
    if not isinstance(base, str):
        raise origins.error([Problem(("base",), base, "expected the name of a scenario or a path ending in .yaml")])
    try:
        below = _named(base, folder, chain, model)
    except ScenarioError as fault:
        raise ScenarioError(f"{origins.source}: base: {problem}" for problem in fault.problems) from None
    _absolute_data(fields, folder)
    places = {k: v for k, v in below.origins.places.items() if not _replaced(k, fields)}
    return Layer(merged(below.fields, fields), Origins(origins.source, places | origins.places))


def _replaced(location: Location, fields: Any) -> bool:
    """Whether the value at a location of the base is hidden by what `fields` say."""
    for part in location:
        if not isinstance(fields, Mapping):
            return True
        if part not in fields:
            return False
        fields = fields[part]
    return not isinstance(fields, Mapping)


def _absolute_data(fields: Mapping[str, Any], folder: Path) -> None:
    """A recording's path is relative to the file that names it."""
    targets = fields.get("targets")
    if isinstance(targets, dict) and isinstance(targets.get("data"), (str, Path)):
        targets["data"] = str((folder / Path(targets["data"]).expanduser()).resolve())


def merged(below: Any, above: Any) -> Any:
    """Mappings merge deeply, anything else replaces."""
    if not (isinstance(below, Mapping) and isinstance(above, Mapping)):
        return above
    below = _without_other_noise(below, above)
    return {**below, **{k: merged(below[k], v) if k in below else v for k, v in above.items()}}


def _without_other_noise(below: Mapping[str, Any], above: Mapping[str, Any]) -> Mapping[str, Any]:
    # sigma and noise_cov say the same thing: naming one replaces the other.
    for given, other in (("sigma", "noise_cov"), ("noise_cov", "sigma")):
        if above.get(given) is not None and other not in above and other in below:
            return {**below, other: None}
    return below


def apply_overrides(layer: Layer, overrides: Mapping[str, Any], model: type[BaseModel]) -> Layer:
    """Fields given by dotted path, or by a last name that fits one field only."""
    fields, places = layer.fields, dict(layer.origins.places)
    problems: list[str] = []
    for key, value in overrides.items():
        location = _full_location(key, value, layer, model)
        if isinstance(location, str):
            problems.append(f"{layer.origins.source} (override): {key} = {shown(value)}: {location}")
            continue
        change: Any = plain(value)
        for part in reversed(location):
            change = {part: change}
        _absolute_data(change, Path.cwd())
        fields = merged(fields, change)
        places = {k: v for k, v in places.items() if k[: len(location)] != location} | {location: ("override", 0)}
    if problems:
        raise ScenarioError(problems)
    return Layer(fields, Origins(layer.origins.source, places))


def _full_location(key: str, value: Any, layer: Layer, model: type[BaseModel]) -> tuple[str, ...] | str:
    """The location that a key means, or what is wrong with it."""
    known = list(field_paths())
    if tuple(key.split(".")) in known:
        return tuple(key.split("."))
    candidates = [p for p in known if p[-1] == key]
    fitting = [p for p in candidates if _fits(value, p, model)] if len(candidates) > 1 else candidates
    if len(fitting) == 1:
        return fitting[0]
    if candidates:
        return f"several fields have this name; expected one of {', '.join(map('.'.join, candidates))}"
    names = {p[-1]: ".".join(p) for p in known} | {".".join(p): ".".join(p) for p in known}
    match = suggestion(key, names)
    for short, full in names.items():
        match = match.replace(repr(short), repr(full))
    return f"unknown field; {match or 'expected a field of base.yaml'}".strip("; ")


def plain(value: Any) -> Any:
    """NumPy numbers and arrays, paths and nested mappings as YAML could have given them."""
    if isinstance(value, Mapping):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, Path):
        return str(value)
    return value.tolist() if hasattr(value, "tolist") else value


def field_paths() -> Iterator[tuple[str, ...]]:
    """The location of every field that can be overridden: the mappings of `base.yaml` and what is in them."""

    def walk(fields: Mapping[str, Any], prefix: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
        for name, value in fields.items():
            yield (*prefix, name)
            if isinstance(value, Mapping):
                yield from walk(value, (*prefix, name))

    return walk(_packaged("base")[0], ())


def _fits(value: Any, location: tuple[str, ...], model: type[BaseModel]) -> bool:
    fields: Any = model.model_fields
    for part in location[:-1]:
        fields = fields[part].annotation.model_fields
    info = fields[location[-1]]
    try:
        TypeAdapter(Annotated[info.annotation, info]).validate_python(plain(value))
    except ValidationError:
        return False
    return True
