"""What a recording decides in a scenario: the horizon, the area, the number of targets, where agents stand."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

from trust_env.scenario_errors import Problem
from trust_env.scenario_loading import Layer

if TYPE_CHECKING:
    from trust_env.recording import Recording

_FROM_RECORDING = (("horizon",), ("area",), ("targets", "slots"))


def fill_from_recording(layer: Layer) -> Layer:
    """Fields that are null, or that follow from what is given, get their value from the recording or the positions."""
    targets, dt = layer.fields.get("targets"), layer.fields.get("dt")
    if not isinstance(targets, dict):
        return layer  # reported by the types
    if targets.get("data") is None:
        _refuse_without_data(layer, targets)
        slots = {"slots": len(targets["positions"])} if isinstance(targets.get("positions"), (list, tuple)) else {}
        return Layer({**layer.fields, "targets": {**targets, **slots}}, layer.origins)
    if not isinstance(targets["data"], str) or not isinstance(dt, (int, float)) or not 0 < dt < float("inf"):
        return layer
    return Layer(_filled(layer, targets, dt), layer.origins)


def _filled(layer: Layer, targets: dict[str, Any], dt: float) -> dict[str, Any]:
    from trust_env.recording import cached_recording

    try:
        recording = cached_recording(targets["data"], dt)
    except ValueError as fault:
        raise layer.origins.error([Problem(("targets", "data"), targets["data"], str(fault))]) from None
    found = {"horizon": len(recording.times), "area": list(recording.bounds)}
    fields = {k: found[k] if v is None and k in found else v for k, v in layer.fields.items()}
    return {**fields, "targets": {**targets, "slots": len(recording.ids)}}


def _refuse_without_data(layer: Layer, targets: dict[str, Any]) -> None:
    values = {("horizon",): layer.fields.get("horizon"), ("area",): layer.fields.get("area")}
    values[("targets", "slots")] = targets.get("slots") if targets.get("positions") is None else 0
    empty = [".".join(location) for location, value in values.items() if value is None]
    if empty:
        name = layer.origins.source
        text = (
            f"{' and '.join(empty)} come from a recording; expected the path of a CSV file (OpenSky state vectors, or "
            f'columns t,id,x,y): load_scenario("{name}", data="traffic.csv"), {name}(data="traffic.csv") on the command '
            "line, or `targets: {data: traffic.csv}` in YAML"
        )
        raise layer.origins.error([Problem(("targets", "data"), None, text)])


def traffic_centres(recording: Recording, n_agents: int) -> tuple[tuple[float, float], ...]:
    """Centres of k-means over the recorded positions, [K] points in m, the busiest first."""
    return _centres(recording, n_agents)


@functools.lru_cache(maxsize=8)
def _centres(recording: Recording, n_agents: int) -> tuple[tuple[float, float], ...]:
    import numpy as np
    from scipy.cluster.vq import kmeans2

    points = recording.positions[~np.isnan(recording.positions[..., 0])]
    chosen = [points.mean(axis=0)]
    for _ in range(n_agents - 1):  # far apart, so that the result depends on no random start
        distance = np.min([np.hypot(*(points - c).T) for c in chosen], axis=0)
        chosen.append(points[distance.argmax()])
    centres, members = kmeans2(points, np.array(chosen), minit="matrix", iter=50, missing="warn")
    order = np.argsort(-np.bincount(members, minlength=n_agents), kind="stable")
    return tuple((float(x), float(y)) for x, y in centres[order])
