"""Command line: scenarios list, show, check."""

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
    """All fields of a scenario, as YAML that can be edited and used."""
    from trust_env.scenario.yaml_lines import write_yaml

    fields = resolved_fields(name, data)
    if as_json:
        print_json(fields)
    else:
        print(write_yaml(fields).rstrip())


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
    "What worlds there are: list, show, check.",
    {"list": list_scenarios, "show": show_scenario, "check": check_scenarios},
)
