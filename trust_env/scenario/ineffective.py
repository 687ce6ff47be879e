"""Overrides that would change nothing, as another field decides the same."""

from __future__ import annotations

from trust_env.scenario.errors import OVERRIDE, Location, Problem
from trust_env.scenario.layers import Layer, value_at

_DECIDED_BY: dict[Location, Location] = {
    ("team", "n_adversaries"): ("agents",),
    ("team", "n_benign"): ("agents",),
    ("team", "order"): ("agents",),
    ("targets", "slots"): ("targets", "positions"),
    ("targets", "velocities"): ("targets", "data"),
}


def reject_ineffective_overrides(layer: Layer) -> None:
    """Raise the first override that another field, if it is not null, makes ineffective."""
    for location, decisive in _DECIDED_BY.items():
        value, decided = value_at(layer.fields, location), value_at(layer.fields, decisive) is not None
        if decided and value is not None and layer.origins.by_location.get(location) == (OVERRIDE, 0):
            text = f"{'.'.join(map(str, decisive))} decides this here; override that, or make it null (None)"
            raise layer.origins.error([Problem(location, value, text)])
