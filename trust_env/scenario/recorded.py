"""What a recording decides in a scenario: the horizon, the area, the targets, and where agents stand."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

from trust_env.scenario.errors import Problem
from trust_env.scenario.overrides import Layer

if TYPE_CHECKING:
    from trust_env.scenario.recording import Recording


def filled(layer: Layer) -> Layer:
    """Set what is null or follows: by the recording, or by the list of positions."""
    targets = layer.fields["targets"]
    if not isinstance(targets, dict):
        return layer  # the types will tell
    if isinstance(targets.get("data"), str):
        return Layer(_by_recording(layer, targets), layer.origins)
    if isinstance(positions := targets.get("positions"), (list, tuple)):
        targets = {**targets, "slots": len(positions)}
    _refuse_nulls(layer, targets)
    return Layer({**layer.fields, "targets": targets}, layer.origins)


def _by_recording(layer: Layer, targets: dict[str, Any]) -> dict[str, Any]:
    from trust_env.scenario.recording import cached_recording

    dt = layer.fields["dt"]
    if isinstance(dt, bool) or not isinstance(dt, (int, float)) or not 0 < dt < float("inf"):
        return layer.fields  # the types will tell
    try:
        recording = cached_recording(targets["data"], dt)
    except ValueError as fault:
        raise layer.origins.error([Problem(("targets", "data"), targets["data"], str(fault))]) from None
    decided = {"horizon": len(recording.times), "area": list(recording.area)}
    fields = {name: decided.get(name) if value is None else value for name, value in layer.fields.items()}
    return {**fields, "targets": {**targets, "slots": len(recording.ids)}}


def _refuse_nulls(layer: Layer, targets: dict[str, Any]) -> None:
    values = {
        "horizon": layer.fields["horizon"],
        "area": layer.fields["area"],
        "targets.slots": targets["slots"],
    }
    nulls = [name for name, value in values.items() if value is None]
    if nulls:
        source = layer.origins.source if layer.origins.source != "mapping" else layer.fields["name"]
        text = (
            f"a recording decides {', '.join(nulls)} (null); expected the path of a CSV file with OpenSky "
            f'state vectors or columns t,id,x,y, as in load_scenario("{source}", data="traffic.csv"), '
            f"{source}(data='traffic.csv') on the command line, or `targets: {{data: traffic.csv}}` in YAML"
        )
        raise layer.origins.error([Problem(("targets", "data"), None, text)])


@functools.lru_cache(maxsize=8)
def traffic_centres(recording: Recording, n_agents: int) -> tuple[tuple[float, float], ...]:
    """Centres of k-means over the recorded positions, K points in m, the busiest first."""
    import numpy as np
    from scipy.cluster.vq import kmeans2

    points = recording.positions[~np.isnan(recording.positions[..., 0])]
    start = [points.mean(axis=0)]
    while len(start) < n_agents:  # each far from the others: no random start, the same result everywhere
        apart = np.min([np.hypot(*(points - centre).T) for centre in start], axis=0)
        start.append(points[apart.argmax()])
    centres, members = kmeans2(points, np.array(start), minit="matrix", iter=50)
    busiest = np.argsort(-np.bincount(members, minlength=n_agents), kind="stable")
    return tuple((float(x), float(y)) for x, y in centres[busiest])
