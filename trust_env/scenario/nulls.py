"""Nulls: the fields that a recording, or the list of positions, decides."""

from __future__ import annotations

import math
from typing import Any

from trust_env.scenario.errors import Problem, ScenarioError
from trust_env.scenario.layers import Layer
from trust_env.scenario.recording import Recording, cached_recording


def resolve_nulls(layer: Layer) -> Layer:
    """The layer with the horizon, area and target slots that follow from the recording or the positions.

    Where the types are wrong, fields stay as they are: validation says so.
    """
    targets = layer.fields["targets"]
    if not isinstance(targets, dict):
        return layer
    if isinstance(targets.get("data"), str):
        return _resolve_by_recording(layer, targets)
    if isinstance(positions := targets.get("positions"), (list, tuple)):
        targets = {**targets, "slots": len(positions)}
    _reject_nulls(layer, targets)
    return Layer({**layer.fields, "targets": targets}, layer.origins)


def _resolve_by_recording(layer: Layer, targets: dict[str, Any]) -> Layer:
    dt = layer.fields["dt"]
    if isinstance(dt, bool) or not isinstance(dt, (int, float)) or not 0 < dt < math.inf:
        return layer
    recording = _read(layer, targets["data"], dt)
    decided = {"horizon": len(recording.times), "area": list(recording.area)}
    fields = {name: decided.get(name) if value is None else value for name, value in layer.fields.items()}
    return Layer({**fields, "targets": {**targets, "slots": len(recording.ids)}}, layer.origins)


def _read(layer: Layer, path: str, dt: float) -> Recording:
    try:
        return cached_recording(path, dt)
    except ValueError as fault:
        raise layer.origins.error([Problem(("targets", "data"), path, str(fault))]) from None


def _reject_nulls(layer: Layer, targets: dict[str, Any]) -> None:
    fields = layer.fields
    values = {"horizon": fields["horizon"], "area": fields["area"], "targets.slots": targets["slots"]}
    if nulls := [name for name, value in values.items() if value is None]:
        raise _recording_expected(layer, nulls)


def _recording_expected(layer: Layer, nulls: list[str]) -> ScenarioError:
    source = layer.origins.source if layer.origins.source != "mapping" else layer.fields["name"]
    text = (
        f"a recording decides {', '.join(nulls)} (null); expected the path of a CSV file with OpenSky "
        f'state vectors or columns t,id,x,y, as in load_scenario("{source}", data="traffic.csv"), '
        f"{source}(data='traffic.csv') on the command line, or `targets: {{data: traffic.csv}}` in YAML"
    )
    return layer.origins.error([Problem(("targets", "data"), None, text)])
