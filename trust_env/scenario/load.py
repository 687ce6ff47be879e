"""From a source and overrides to a scenario: read the layers, merge them, resolve nulls, validate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from trust_env.scenario.errors import Location, Problem, ScenarioError, problems_of
from trust_env.scenario.ineffective import notes, reject_ineffective_overrides
from trust_env.scenario.layers import Layer, merge_layers, with_defaults
from trust_env.scenario.nulls import resolve_nulls
from trust_env.scenario.scenario import Scenario
from trust_env.scenario.sources import Source, read_layers


def load_scenario(source: Source, /, **overrides: Any) -> Scenario:
    """A scenario from a built-in name, `patrol(horizon=50)`, a path ending in .yaml, a mapping or a scenario.

    Overrides name a field by its dotted path (`**{"tracker.gate": 0.95}`) or by a last name that fits one
    field only (`gate=0.95`). Raises ScenarioError, a ValueError, that lists everything that is wrong.
    """
    layer = _read(source, overrides)
    reject_ineffective_overrides(layer)
    layer, problems = resolve_nulls(layer)
    if not problems:
        try:
            return Scenario.model_validate(layer.fields)
        except ValidationError as error:
            problems = problems_of(error, Scenario)
    raise layer.origins.error(_and_all_others(layer, problems))


def scenario_notes(source: Source, /, **overrides: Any) -> list[str]:
    """What a source sets without effect, as another field decides the same; a line each."""
    return notes(_read(source, overrides))


def scenario_fields(source: Source, /, **overrides: Any) -> dict[str, Any]:
    """All fields of a source as written, unchecked; null where a recording, given later, will decide."""
    return _read(source, overrides).fields


def _read(source: Source, overrides: Mapping[str, Any]) -> Layer:
    try:
        return merge_layers(read_layers(source, overrides))
    except RecursionError:
        raise ScenarioError(["the scenario is nested too deep, or contains itself"]) from None


def _and_all_others(layer: Layer, problems: list[Problem]) -> list[Problem]:
    """The problems, and those that show once all fields concerned have their defaults, and do not concern these."""
    found, replaced, known, base = list(problems), list[Location](), -1, _read("base", {}).fields
    while known < len(replaced):
        known = len(replaced)
        for problem in problems:
            at = problem.location
            while at in replaced and len(at) > 1:  # wrong without it, too: what holds it is replaced
                at = at[:-1]
            replaced += [field for field in (at, *problem.judged_by) if field not in replaced]
        try:
            Scenario.model_validate(with_defaults(layer.fields, replaced, base, {"agents": {"role": "benign"}}))
            break
        except ValidationError as error:
            problems = problems_of(error, Scenario)
        found += [problem for problem in problems if not problem.concerns(replaced)]
    return found
