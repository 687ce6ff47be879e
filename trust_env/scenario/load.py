"""From a source and overrides to a scenario: read the layers, merge them, resolve nulls, validate."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from trust_env.scenario.errors import problems_of
from trust_env.scenario.ineffective import reject_ineffective_overrides
from trust_env.scenario.layers import Layer, merge_layers
from trust_env.scenario.nulls import resolve_nulls
from trust_env.scenario.scenario import Scenario
from trust_env.scenario.sources import Source, read_layers


def load_scenario(source: Source, /, **overrides: Any) -> Scenario:
    """A scenario from a built-in name, `patrol(horizon=50)`, a path ending in .yaml, a mapping or a scenario.

    Overrides name a field by its dotted path (`**{"tracker.gate": 0.95}`) or by a last name that fits one
    field only (`gate=0.95`). Raises ScenarioError, a ValueError, that lists everything that is wrong.
    """
    layers = read_layers(source, overrides)
    layer = merge_layers(layers)
    reject_ineffective_overrides(layer)
    layer = resolve_nulls(layer)
    return _validate(layer)


def scenario_fields(source: Source, /, **overrides: Any) -> dict[str, Any]:
    """All fields of a source as written, unchecked; null where a recording, given later, will decide."""
    return merge_layers(read_layers(source, overrides)).fields


def _validate(layer: Layer) -> Scenario:
    try:
        return Scenario.model_validate(layer.fields)
    except ValidationError as error:
        raise layer.origins.error(problems_of(error, Scenario)) from None
