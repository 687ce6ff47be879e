"""Fields that change nothing, as another field decides the same."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from trust_env.scenario.errors import OVERRIDE, Location, Problem, dotted
from trust_env.scenario.layers import Layer, value_at

_DECIDED_BY: tuple[tuple[Location, Location], ...] = (
    (("team", "n_adversaries"), ("agents",)),
    (("team", "n_benign"), ("agents",)),
    (("team", "order"), ("agents",)),
    (("team", "platforms"), ("agents",)),
    (("targets", "slots"), ("targets", "positions")),
    (("targets", "slots"), ("targets", "data")),
    (("targets", "velocities"), ("targets", "data")),
)

_PLACEMENT: Location = ("team", "placement")
_DRAWN = ("random", "overlapping")  # placements that draw the heading of an agent with its position


def reject_ineffective_overrides(layer: Layer) -> None:
    """Raise all overrides that another field, if it is not null, makes ineffective."""
    problems = [
        Problem(location, value, f"{dotted(decisive)} decides this here; override that, or make it null (None)")
        for location, decisive, value in _ineffective(layer)
        if layer.origins.by_location.get(location) == (OVERRIDE, 0)
    ]
    if problems:
        raise layer.origins.error(problems)


def notes(layer: Layer) -> list[str]:
    """What the source itself sets, and what has no effect, a line each: `my.yaml, line 3: team.n_benign = 3: ...`."""
    origins = layer.origins
    return [
        origins.format(Problem(location, value, f"has no effect, as {dotted(decisive)} decides this"))
        for location, decisive, value in _ineffective(layer)
        if origins.by_location.get(location, ("", 0))[0] == origins.source
    ]


def _ineffective(layer: Layer) -> Iterator[tuple[Location, Location, object]]:
    """Fields that are set, what decides in their place, and their values."""
    for location, decisive in _DECIDED_BY:
        value = value_at(layer.fields, location)
        if value is not None and value_at(layer.fields, decisive) is not None:
            yield location, decisive, value
    agents = layer.fields.get("agents")
    if value_at(layer.fields, _PLACEMENT) in _DRAWN and isinstance(agents, list):
        for k, entry in enumerate(agents):
            if isinstance(entry, Mapping) and entry.get("heading") and entry.get("position") is None:
                yield ("agents", k, "heading"), _PLACEMENT, entry["heading"]
