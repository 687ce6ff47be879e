"""From a built-in name, a YAML file or a mapping to all fields: its own over those of its base."""

from __future__ import annotations

import copy
import functools
import re
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from trust_env.errors import unknown_name
from trust_env.scenario.errors import Location, Origins, Problem, ScenarioError
from trust_env.scenario.overrides import Layer, absolute_data, over, override, places, plain
from trust_env.scenario.yaml_lines import read_yaml
from trust_env.spec import parse

_FILE = re.compile(r"(?P<path>.*\.ya?ml)\s*(?P<call>\(.*\))?", re.DOTALL | re.IGNORECASE)
_BUILT_IN = resources.files("trust_env.scenario") / "builtin"


def scenarios() -> tuple[str, ...]:
    """The names of the built-in scenarios."""
    names = (Path(entry.name) for entry in _BUILT_IN.iterdir())
    return tuple(sorted(n.stem for n in names if n.suffix == ".yaml" and n.stem != "base"))


def defaults() -> Mapping[str, Any]:
    """The fields of `base.yaml`: every field there is."""
    return _packaged("base")[0]


def read_source(source: str | Path | Mapping[str, Any]) -> Layer:
    """All fields of a source, as written: neither checked nor filled from a recording."""
    if isinstance(source, Mapping):
        fields = plain(source)
        return _over_base(fields, Origins("mapping", places(fields, "mapping")), Path.cwd(), ())
    if isinstance(source, (str, Path)):
        return _named(str(source), Path.cwd(), ())
    raise ScenarioError([f"{source!r}: expected a scenario's name, a path ending in .yaml or a mapping"])


def _named(source: str, folder: Path, chain: tuple[str, ...]) -> Layer:
    """A built-in name or a path, either with overrides in brackets behind it."""
    file = _FILE.fullmatch(source.strip())
    try:
        spec = parse("scenario" + (file["call"] or "")) if file else parse(source)
    except ValueError as fault:
        hint = "" if file else "; a file's name ends in .yaml"
        raise ScenarioError([f"{fault}{hint}"]) from None
    layer = _file(file["path"], folder, chain) if file else _built_in(spec.name)
    return override(layer, spec.params, defaults())


def _built_in(name: str) -> Layer:
    if name not in (*scenarios(), "base"):
        raise ScenarioError([f"{unknown_name('scenario', name, scenarios())}; a file's name ends in .yaml"])
    fields, lines = _packaged(name)
    origins = Origins(name, {location: (f"{name}.yaml", line) for location, line in lines.items()})
    fields = copy.deepcopy(fields)
    return Layer(fields, origins) if name == "base" else _over_base(fields, origins, Path.cwd(), ())


@functools.cache
def _packaged(name: str) -> tuple[dict[str, Any], dict[Location, int]]:
    return read_yaml((_BUILT_IN / f"{name}.yaml").read_text(encoding="utf-8"), f"{name}.yaml")


def _file(name: str, folder: Path, chain: tuple[str, ...]) -> Layer:
    path = (folder / Path(name).expanduser()).resolve()
    if str(path) in chain:
        circle = (*chain[chain.index(str(path)) :], str(path))
        names = " -> ".join(Path(p).name for p in circle)
        raise ScenarioError([f"{name}: the files name each other as base, in a circle: {names}"])
    fields, lines = read_yaml(_text(path, name), name)
    fields.setdefault("name", path.stem)
    origins = Origins(name, {location: (name, line) for location, line in lines.items()})
    return _over_base(fields, origins, path.parent, (*chain, str(path)))


def _text(path: Path, name: str) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ScenarioError([f"{name}: expected a YAML file in UTF-8"]) from None
    except OSError as fault:
        reason = "there is no such file" if isinstance(fault, FileNotFoundError) else fault.strerror
        raise ScenarioError([f"{name}: {reason}; expected a YAML file (looked for {path})"]) from None


def _over_base(fields: dict[str, Any], origins: Origins, folder: Path, chain: tuple[str, ...]) -> Layer:
    base = fields.pop("base", "base")
    if not isinstance(base, str):
        expected = "expected the name of a scenario or a path ending in .yaml"
        raise origins.error([Problem(("base",), base, expected)])
    try:
        below = _named(base, folder, chain)
    except ScenarioError as fault:
        raise ScenarioError(f"{origins.place(('base',))}: base: {text}" for text in fault.problems) from None
    absolute_data(fields, folder)
    return over(below, fields, origins)
