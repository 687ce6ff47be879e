"""The entries of a registry of defenses or attacks: descriptions and parameters, as values and as text."""

from __future__ import annotations

import inspect
import json
from collections.abc import Mapping
from typing import Any, cast

from trust_env.errors import unknown_name
from trust_env.spec import load_object, parse
from trust_env.training.cli.options import print_json

Registry = Mapping[str, type]


def descriptions(registry: Registry) -> dict[str, str]:
    """First lines of the documentation by name."""
    return {name: (inspect.getdoc(entry) or "").split("\n")[0] for name, entry in registry.items()}


def describe_entry(kind: str, text: str, registry: Registry) -> dict[str, Any]:
    """Name, doc, knowledge, parameters and presets of an entry, or of one in a file (`my_file.py:Name`); of a
    learned attack (`runs/a`) its file and its config.

    `parameters`: {name: {"default": value, "choices": [...]}}, without a default where one has to be given
    and without choices where there is no list; `presets`: by name, the parameters that they set differently.
    """
    from trust_env.agents import build_policy, parse_policy
    from trust_env.agents.learned.policy import Learned

    spec = parse_policy(text) if kind == "attack" else parse(text)
    if spec.path is None and spec.name not in registry:
        raise unknown_name(kind, spec.name, registry)
    entry: Any = load_object(spec) if spec.path is not None else registry[spec.name]
    if not callable(entry):
        raise ValueError(f"{text}: expected a class, or a function that makes a {kind}")
    found: dict[str, Any] = {"name": spec.name, "doc": inspect.getdoc(entry) or ""}
    if entry is Learned and spec.params:
        policy = cast(Learned, build_policy(text))
        return found | {"knowledge": policy.knowledge, "file": str(policy.file), "config": policy.config}
    knowledge = getattr(entry, "knowledge", None)
    return found | ({"knowledge": knowledge} if isinstance(knowledge, str) else {}) | _parameters(entry)


def _parameters(entry: Any) -> dict[str, Any]:
    presets = _presets(entry)
    defaults = next(iter(presets.values()), {})
    parameters: dict[str, dict[str, Any]] = {}
    for p in inspect.signature(entry).parameters.values():
        if p.kind is p.VAR_KEYWORD:
            parameters |= {name: {"default": value} | _choices(name) for name, value in defaults.items()}
        elif p.kind is not p.VAR_POSITIONAL:
            parameters[p.name] = {} if p.default is p.empty else {"default": p.default}
    differing = {
        preset: {name: value for name, value in values.items() if value != defaults[name]}
        for preset, values in presets.items()
    }
    return {"parameters": parameters} | ({"presets": differing} if presets else {})


def _choices(switch: str) -> dict[str, list[str]]:
    """What a switch of `trust` can be, where names are given to choose from."""
    from trust_env.defenses.trust import Trust

    known = Trust.choices(switch)
    return {"choices": known} if known else {}


def _presets(made: Any) -> Mapping[str, Mapping[str, Any]]:
    """The presets of a class that takes its switches as keywords, the default one first."""
    return made.presets() if hasattr(made, "presets") else {}


def print_names(names: Mapping[str, str], as_json: bool) -> None:
    """A line for every name, with its description; or as JSON."""
    if as_json:
        print_json([{"name": name, "description": text} for name, text in names.items()])
        return
    width = max(map(len, names))
    for name, text in names.items():
        print(f"{name:{width}}  {text}")


def print_entry(entry: dict[str, Any], as_json: bool) -> None:
    """What `describe_entry` found, as text or as JSON."""
    if as_json:
        print(json.dumps(entry, indent=2, default=str))
        return
    print(f"{entry['name']}\n\n{entry['doc']}\n")
    if "knowledge" in entry:
        print(f"knowledge: {entry['knowledge']}")
    if "config" in entry:
        _print_config(entry["file"], entry["config"])
        return
    print("parameters:" if entry["parameters"] else "parameters: none")
    for name, values in entry["parameters"].items():
        default = f" = {values['default']!r}" if "default" in values else "  (to be given)"
        print(f"  {name}{default}" + (f"  ({' | '.join(values['choices'])})" if "choices" in values else ""))
    for preset, values in entry.get("presets", {}).items():
        print(f"preset {preset}:" + ("" if values else " the defaults above"))
        for name, value in values.items():
            print(f"  {name} = {value!r}")


def _print_config(file: str, config: Mapping[str, Any]) -> None:
    print(f"file: {file}")
    for name, value in config.items():
        for line in [f"{name}: {value}"] if name != "about" else [f"{k}: {v}" for k, v in value.items()]:
            print(f"  {line}")
