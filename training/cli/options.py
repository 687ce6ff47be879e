"""Options that several commands have, and how their values are read and their results printed."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Protocol

from tyro.conf import Positional, UseAppendAction, arg

Json = Annotated[bool, arg(name="json", help="print JSON instead of text")]
Data = Annotated[Path | None, arg(help="CSV file of recorded trajectories (targets.data)")]
Seed = Annotated[int, arg(help="seed of all random numbers")]
Knowledge = Annotated[Literal["own", "poses", "picture", "white_box"] | None, arg(help="what agents observe")]
_SCENARIO = arg(help="name, name(field=value, ...), or a YAML file")
Scenario = Annotated[str, _SCENARIO]
ScenarioOrDefault = Annotated[str | None, _SCENARIO]
ScenarioName = Annotated[Positional[str], _SCENARIO]
Repeated = UseAppendAction[tuple[str, ...]]

OK, CHECK_FAILED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130  # exit codes

Command = Callable[..., int | None]
"""A function that returns an exit code, or None when all is well; its parameters are the options."""


class Group(NamedTuple):
    """Commands under a common first word, such as `scenarios list`."""

    help: str
    commands: Mapping[str, Command]


class Report(Protocol):
    """The outcome of a command, which can be printed as tables and as JSON."""

    def to_dict(self) -> dict[str, Any]: ...

    def print(self, console: Any) -> None: ...


def print_report(report: Report, as_json: bool) -> None:
    """Print a report as JSON, or as tables as wide as the screen."""
    from rich.console import Console

    if as_json:
        print_json(report.to_dict())
    else:
        report.print(Console())


def print_json(value: Any) -> None:
    """Print plain values as JSON."""
    print(json.dumps(value, indent=2, allow_nan=False))


def fields_of(texts: tuple[str, ...]) -> dict[str, Any]:
    """The values of `--set` by field, read as YAML: {"tracker.gate": 0.95} from tracker.gate=0.95."""
    from trust_env.scenario.yaml_lines import read_yaml

    texts_by_field = assignments(texts, "--set", "FIELD=VALUE, such as tracker.gate=0.95")
    return {
        field: read_yaml(f"value: {value}", f"--set {field}={value}")[0]["value"]
        for field, value in texts_by_field.items()
    }


def assignments(texts: tuple[str, ...], option: str, expected: str) -> dict[str, str]:
    """{"name": "value"} from name=value. ValueError, naming the option: something else, or a name twice."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (equals and name):
            raise ValueError(f"{option} {text}: expected {expected}")
        if name in found:
            raise ValueError(f"{option} {text}: {name} is given twice")
        found[name] = value
    return found
