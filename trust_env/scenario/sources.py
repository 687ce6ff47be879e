"""Sources: what a built-in name, a YAML file, a mapping or a scenario says, as layers over `base.yaml`."""

from __future__ import annotations

import copy
import functools
import re
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from trust_env.errors import unknown_name
from trust_env.files import expanded
from trust_env.scenario.errors import Location, Origins, Problem, ScenarioError
from trust_env.scenario.layers import Layer, absolute_data, locations, merge_layers, to_builtin
from trust_env.scenario.overrides import override_layer
from trust_env.scenario.scenario import Scenario
from trust_env.scenario.yaml_lines import read_yaml
from trust_env.spec import parse

Source = str | Path | Mapping[str, Any] | Scenario

_FILE = re.compile(r"(?P<path>.*\.ya?ml)\s*(?P<call>\(.*\))?", re.DOTALL | re.IGNORECASE)
NO_DESCRIPTION = "no description is given"  # of a scenario that has its own name
_MAX_FILES = 10  # each the base of the one before
_MAX_CHARACTERS = 1_000_000  # of a file
_BUILT_IN = resources.files("trust_env.scenario") / "builtin"


def scenarios() -> tuple[str, ...]:
    """The names of the built-in scenarios."""
    names = (Path(entry.name) for entry in _BUILT_IN.iterdir())
    return tuple(sorted(n.stem for n in names if n.suffix == ".yaml" and n.stem != "base"))


def read_layers(source: Source, overrides: Mapping[str, Any]) -> list[Layer]:
    """The layers of a source, the lowest first, and over them the overrides: as written, unchecked."""
    return _overridden(_read_source(source), overrides)


def _read_source(source: Source) -> list[Layer]:
    if isinstance(source, Scenario):  # has all fields, so that it needs no base
        return [Layer(to_builtin(source.model_dump()), Origins(source.name))]
    if isinstance(source, Mapping):
        fields = to_builtin(source)
        return _over_base(Layer(fields, Origins("mapping", locations(fields, "mapping"))), Path.cwd(), ())
    if isinstance(source, (str, Path)):
        return _read_named(str(source), Path.cwd(), ())
    raise ScenarioError([f"{source!r}: expected a scenario's name, a path ending in .yaml or a mapping"])


def _overridden(layers: list[Layer], overrides: Mapping[str, Any]) -> list[Layer]:
    return [*layers, override_layer(overrides, _packaged("base")[0], layers[-1].origins.source)]


def _read_named(source: str, folder: Path, chain: tuple[str, ...]) -> list[Layer]:
    """A built-in name or a path, either with overrides in brackets behind it."""
    file = _FILE.fullmatch(source.strip())
    try:
        spec = parse("scenario" + (file["call"] or "")) if file else parse(source)
    except ValueError as fault:
        hint = "" if file else "; a file's name ends in .yaml"
        raise ScenarioError([f"{fault}{hint}"]) from None
    layers = _read_file(file["path"], folder, chain) if file else _read_built_in(spec.name)
    return _overridden(layers, spec.params)


def _read_built_in(name: str) -> list[Layer]:
    if name not in (*scenarios(), "base"):
        raise ScenarioError([f"{unknown_name('scenario', name, scenarios())}; a file's name ends in .yaml"])
    fields, lines = _packaged(name)
    layer = Layer(copy.deepcopy(fields), Origins.in_file(name, f"{name}.yaml", lines))
    return [layer] if name == "base" else _over_base(layer, Path.cwd(), ())


@functools.cache
def _packaged(name: str) -> tuple[dict[str, Any], dict[Location, int]]:
    return read_yaml((_BUILT_IN / f"{name}.yaml").read_text(encoding="utf-8"), f"{name}.yaml")


def _read_file(name: str, folder: Path, chain: tuple[str, ...]) -> list[Layer]:
    """The layers of a file; `chain` are the files that led here, each as the base of the one before."""
    try:
        path = (folder / expanded(name)).resolve()
    except (OSError, RuntimeError, ValueError) as fault:
        raise ScenarioError([f"{name!r}: {fault}; expected the path of a YAML file"]) from None
    if len(chain) == _MAX_FILES:
        raise ScenarioError([f"{name}: more than {_MAX_FILES} files, each the base of another"])
    if str(path) in chain:
        circle = (*chain[chain.index(str(path)) :], str(path))
        names = " -> ".join(Path(p).name for p in circle)
        raise ScenarioError([f"{name}: the files name each other as base, in a circle: {names}"])
    fields, lines = read_yaml(_text(path, name), name)
    fields.setdefault("name", path.stem)
    return _over_base(Layer(fields, Origins.in_file(name, name, lines)), path.parent, (*chain, str(path)))


def _text(path: Path, name: str) -> str:
    try:
        if path.exists() and not (path.is_file() or path.is_dir()):  # a pipe would wait, a device need not end
            raise ScenarioError([f"{name}: expected a YAML file, not a pipe or device"])
        with open(path, encoding="utf-8-sig") as file:
            text = file.read(_MAX_CHARACTERS + 1)
        if len(text) > _MAX_CHARACTERS:
            raise ScenarioError([f"{name}: expected a file of at most {_MAX_CHARACTERS} characters"])
        return text
    except UnicodeDecodeError:
        raise ScenarioError([f"{name}: expected a YAML file in UTF-8"]) from None
    except OSError as fault:
        reason = "there is no such file" if isinstance(fault, FileNotFoundError) else fault.strerror
        raise ScenarioError([f"{name}: {reason}; expected a YAML file (looked for {path})"]) from None


def _over_base(layer: Layer, folder: Path, chain: tuple[str, ...]) -> list[Layer]:
    """The layers of the base that a layer names, else of `base.yaml`, and that layer over them."""
    fields = {name: value for name, value in layer.fields.items() if name != "base"}
    base = layer.fields.get("base", "base")
    if not isinstance(base, str):
        expected = "expected the name of a scenario or a path ending in .yaml"
        raise layer.origins.error([Problem(("base",), base, expected)])
    try:
        below = _read_named(base, folder, chain)
    except ScenarioError as error:
        prefix = layer.origins.describe(("base",))
        raise ScenarioError(f"{prefix}: base: {text}" for text in error.problems) from None
    named = merge_layers(below).fields["name"]
    if fields.get("name", named) != named:  # another scenario than the one it is based on
        fields.setdefault("description", NO_DESCRIPTION)
    return [*below, Layer(absolute_data(fields, folder), layer.origins)]
