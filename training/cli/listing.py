"""The commands that say what there is: scenarios, defenses, attacks."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

Json = Annotated[bool, arg(name="json", help="print JSON instead of text")]
Command = Callable[..., int | None]


def list_scenarios(as_json: Json = False) -> None:
    """The built-in scenarios."""
    from trust_env.training.cli import catalogue

    _print_names(catalogue.list_scenarios(), as_json)


def show_scenario(
    name: Annotated[Positional[str], arg(help="name, name(field=value, ...), or a YAML file")],
    data: Annotated[Path | None, arg(help="CSV file of recorded trajectories (targets.data)")] = None,
    as_json: Json = False,
) -> None:
    """All fields of a scenario, as YAML that can be edited and used."""
    from trust_env.training.cli import catalogue

    fields = catalogue.show_scenario(name, None if data is None else str(data))
    print(json.dumps(fields, indent=2) if as_json else catalogue.as_yaml(fields).rstrip())


def check_scenarios(
    files: Annotated[Positional[tuple[str, ...]], arg(help="YAML files, or scenarios by name")],
    data: Annotated[Path | None, arg(help="CSV file of recorded trajectories (targets.data)")] = None,
    as_json: Json = False,
) -> int:
    """Check scenario files, and list everything that is wrong with them. 1: something is."""
    from trust_env.training.cli import catalogue

    if not files:
        raise ValueError("scenarios check: expected at least one YAML file")
    problems = {file: catalogue.check_scenario(file, None if data is None else str(data)) for file in files}
    if as_json:
        print(json.dumps({"ok": not any(problems.values()), "problems": problems}, indent=2))
    for file, found in problems.items() if not as_json else ():
        print("\n".join(found) if found else f"{file}: ok", file=sys.stderr if found else sys.stdout)
    return 1 if any(problems.values()) else 0


def list_defenses(as_json: Json = False) -> None:
    """The built-in defenses."""
    from trust_env.training.cli import catalogue

    _print_names(catalogue.list_registry(catalogue.defense_registry()), as_json)


def show_defense(
    name: Annotated[Positional[str], arg(help="a defense, or my_file.py:MyDefense")], as_json: Json = False
) -> None:
    """What a defense does, its parameters with their defaults, and its presets."""
    from trust_env.training.cli import catalogue

    _print_entry(catalogue.show_entry("defense", name, catalogue.defense_registry()), as_json)


def list_attacks(as_json: Json = False) -> None:
    """The built-in attacks."""
    from trust_env.training.cli import catalogue

    _print_names(catalogue.list_registry(catalogue.attack_registry()), as_json)


def show_attack(
    name: Annotated[
        Positional[str], arg(help="an attack, my_file.py:MyPolicy, or the folder of a training run")
    ],
    as_json: Json = False,
) -> None:
    """What an attack does, what it must know, and its parameters with their defaults."""
    from trust_env.training.cli import catalogue

    _print_entry(catalogue.show_entry("attack", name, catalogue.attack_registry()), as_json)


def _print_names(names: Mapping[str, str], as_json: bool) -> None:
    if as_json:
        print(json.dumps([{"name": name, "description": text} for name, text in names.items()], indent=2))
        return
    width = max(map(len, names))
    for name, text in names.items():
        print(f"{name:{width}}  {text}")


def _print_entry(entry: dict[str, Any], as_json: bool) -> None:
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


GROUPS: dict[str, tuple[str, dict[str, Command]]] = {
    "scenarios": (
        "What worlds there are: list, show, check.",
        {"list": list_scenarios, "show": show_scenario, "check": check_scenarios},
    ),
    "defenses": ("What judges tracks and agents: list, show.", {"list": list_defenses, "show": show_defense}),
    "attacks": ("What adversaries do: list, show.", {"list": list_attacks, "show": show_attack}),
}
