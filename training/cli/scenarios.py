"""Command line: scenarios list, show, explain, schema, check."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

from trust_env.training.cli.options import CHECK_FAILED, OK, Data, Group, Json, ScenarioName, print_json


def list_scenarios(as_json: Json = False) -> None:
    """The built-in scenarios."""
    from trust_env.scenario import scenario_fields, scenarios
    from trust_env.training.cli.catalogue import print_names

    print_names({name: str(scenario_fields(name)["description"]) for name in scenarios()}, as_json)


def show_scenario(name: ScenarioName, data: Data = None, as_json: Json = False) -> None:
    """All fields of a scenario with units and comments, as YAML that can be edited and used."""
    from trust_env.scenario.commented import commented_yaml

    fields = resolved_fields(name, data)
    if as_json:
        print_json(fields)
    else:
        print(commented_yaml(fields))


def explain_field(
    field: Annotated[Positional[str], arg(help="tracker.gate, gate, agents.fov.radius")], as_json: Json = False
) -> None:
    """What a field of scenarios is: unit, default, the values that it takes, and the fields in it."""
    from trust_env.scenario.json_schema import field_infos, find_field

    found = find_field(field)
    inside = [info for name, info in field_infos().items() if name.startswith((f"{found.name}.", f"{found.name}[]."))]
    if as_json:
        print_json(found._asdict() | {"fields": [info._asdict() for info in inside]})
        return
    print(f"{found.name}\n\n{found.comment}\n")
    if found.unit:
        print(f"unit: {found.unit}")
    print(f"default: {'null' if found.default is None else found.default}" if not inside else "fields:")
    print(f"values: {found.values}" if not inside else "\n".join(f"  {info.name}: {info.comment}" for info in inside))


def print_schema(as_json: Json = False) -> None:
    """The JSON schema of scenario files, for the completion and the checks of editors; JSON in any case."""
    from trust_env.scenario.json_schema import scenario_schema

    print_json(scenario_schema())


def check_scenarios(
    files: Annotated[Positional[tuple[str, ...]], arg(help="YAML files, or scenarios by name")],
    data: Data = None,
    as_json: Json = False,
) -> int:
    """Check scenario files: list everything that is wrong with them, and what has no effect. Exit code 1: something is
    wrong.
    """
    from trust_env.scenario import scenario_notes

    if not files:
        raise ValueError("scenarios check: expected at least one YAML file")
    problems = {file: problems_of(file, data) for file in files}
    notes = {file: [] if problems[file] else scenario_notes(file, **_recording(data)) for file in files}
    if as_json:
        print_json({"ok": not any(problems.values()), "problems": problems, "notes": notes})
    else:
        for file, found in problems.items():
            print("\n".join(found or [f"{file}: ok", *notes[file]]), file=sys.stderr if found else sys.stdout)
    return CHECK_FAILED if any(problems.values()) else OK


def resolved_fields(source: str, data: Path | None) -> dict[str, Any]:
    """All fields of a scenario; without the recording that it needs, null where that will decide."""
    from trust_env.scenario import load_scenario, scenario_fields
    from trust_env.training.evaluation.recording import needs_recording

    if data is None and needs_recording(source):
        return scenario_fields(source)
    return load_scenario(source, **_recording(data)).model_dump(mode="json")


def problems_of(source: str, data: Path | None) -> list[str]:
    """Everything that is wrong with a scenario, a line each."""
    from trust_env.scenario import ScenarioError, load_scenario

    try:
        load_scenario(source, **_recording(data)).recording()
    except ScenarioError as error:
        return list(error.problems)
    except ValueError as error:
        return str(error).splitlines()
    return []


def _recording(data: Path | None) -> dict[str, str]:
    return {} if data is None else {"targets.data": str(data)}


COMMANDS = Group(
    "What worlds there are: list, show, explain, schema, check.",
    {
        "list": list_scenarios,
        "show": show_scenario,
        "explain": explain_field,
        "schema": print_schema,
        "check": check_scenarios,
    },
)
