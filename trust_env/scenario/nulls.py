"""Nulls: the fields that a recording, or the list of positions, decides."""

from __future__ import annotations

from typing import Any

from trust_env.scenario.errors import Location, Problem, dotted
from trust_env.scenario.layers import Layer, value_at
from trust_env.scenario.recording import cached_recording
from trust_env.scenario.types import DURATION

_NULLABLE: tuple[Location, ...] = (("horizon",), ("area",), ("targets", "slots"))


Resolved = tuple[Layer, list[Problem]]


def resolve_nulls(layer: Layer) -> Resolved:
    """The layer with the horizon, area and target slots that follow from the recording or the positions; and what
    keeps them from it.

    Where the types are wrong, fields stay as they are: validation says so.
    """
    targets = layer.fields["targets"]
    if not isinstance(targets, dict):
        return layer, []
    if isinstance(targets.get("data"), str):
        return _resolve_by_recording(layer, targets)
    if isinstance(positions := targets.get("positions"), (list, tuple)):
        targets = {**targets, "slots": len(positions)}
    resolved = Layer({**layer.fields, "targets": targets}, layer.origins)
    return resolved, _null_problems(layer, targets)


def _resolve_by_recording(layer: Layer, targets: dict[str, Any]) -> Resolved:
    dt = layer.fields["dt"]
    if isinstance(dt, bool) or not isinstance(dt, (int, float)) or not DURATION.least <= dt <= DURATION.most:
        return layer, []
    try:
        recording = cached_recording(targets["data"], dt)
    except ValueError as fault:
        return layer, [Problem(("targets", "data"), targets["data"], str(fault), _nulls(layer, targets))]
    decided = {"horizon": len(recording.times), "area": list(recording.area)}
    fields = {name: decided.get(name) if value is None else value for name, value in layer.fields.items()}
    return Layer({**fields, "targets": {**targets, "slots": len(recording.ids)}}, layer.origins), []


def _null_problems(layer: Layer, targets: dict[str, Any]) -> list[Problem]:
    nulls = _nulls(layer, targets)
    return [_recording_expected(layer, nulls)] if nulls else []


def _nulls(layer: Layer, targets: dict[str, Any]) -> tuple[Location, ...]:
    """The fields that are null, and that a recording decides."""
    fields = {**layer.fields, "targets": targets}
    return tuple(location for location in _NULLABLE if value_at(fields, location) is None)


def _recording_expected(layer: Layer, nulls: tuple[Location, ...]) -> Problem:
    source = layer.origins.source if layer.origins.source != "mapping" else layer.fields["name"]
    text = (
        f"a recording decides {', '.join(map(dotted, nulls))} (null); expected the path of a CSV file with OpenSky "
        f'state vectors or columns t,id,x,y, as in load_scenario("{source}", data="traffic.csv"), '
        f"{source}(data='traffic.csv') on the command line, or `targets: {{data: traffic.csv}}` in YAML"
    )
    return Problem(("targets", "data"), None, text, nulls)
