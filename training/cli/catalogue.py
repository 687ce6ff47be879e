"""What there is to play, scenarios, defenses and attacks, as plain values to print or to write as JSON."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any, cast

from trust_env.errors import unknown_name
from trust_env.scenario import ScenarioError, load_scenario, scenario_fields, scenarios
from trust_env.scenario.yaml_lines import write_yaml
from trust_env.spec import load_object, parse

Registry = Mapping[str, type]


def list_scenarios() -> dict[str, str]:
    """Descriptions by name."""
    return {name: str(scenario_fields(name)["description"]) for name in scenarios()}


def needs_recording(scenario: Any) -> bool:
    """Whether a recording, `targets.data`, decides fields of the scenario, and is not given."""
    fields = scenario_fields(scenario)
    return fields["targets"]["data"] is None and (fields["horizon"] is None or fields["area"] is None)


def show_scenario(source: str, data: str | None = None) -> dict[str, Any]:
    """All fields, resolved; without the recording that it needs, null where that will decide."""
    if data is None and needs_recording(source):
        return scenario_fields(source)
    recording = {"targets.data": data} if data is not None else {}
    return load_scenario(source, **recording).model_dump(mode="json")


def check_scenario(source: str, data: str | None = None) -> list[str]:
    """Everything that is wrong with a scenario, a line each."""
    try:
        recording = {"targets.data": data} if data is not None else {}
        load_scenario(source, **recording).recording()
    except ScenarioError as error:
        return list(error.problems)
    except ValueError as error:
        return str(error).splitlines()
    return []


def as_yaml(fields: dict[str, Any]) -> str:
    return write_yaml(fields)


def defense_registry() -> Registry:
    from trust_env.defenses import DEFENSES

    return DEFENSES


def attack_registry() -> Registry:
    from trust_env.agents import POLICIES

    return POLICIES


def list_registry(registry: Registry) -> dict[str, str]:
    """First lines of the documentation by name."""
    return {
        name: (inspect.getdoc(made) or "").split("\n\n")[0].split("\n")[0] for name, made in registry.items()
    }


def show_entry(kind: str, text: str, registry: Registry) -> dict[str, Any]:
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
    made: Any = load_object(spec) if spec.path is not None else registry[spec.name]
    if not callable(made):
        raise ValueError(f"{text}: expected a class, or a function that makes a {kind}")
    shown: dict[str, Any] = {"name": spec.name, "doc": inspect.getdoc(made) or ""}
    if made is Learned and spec.params:
        policy = cast(Learned, build_policy(text))
        return shown | {"knowledge": policy.knowledge, "file": str(policy.file), "config": policy.config}
    knowledge = getattr(made, "knowledge", None)
    return shown | ({"knowledge": knowledge} if isinstance(knowledge, str) else {}) | _parameters(made)


def _parameters(made: Any) -> dict[str, Any]:
    presets = _presets(made)
    defaults = next(iter(presets.values()), {})
    parameters: dict[str, dict[str, Any]] = {}
    for p in inspect.signature(made).parameters.values():
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
