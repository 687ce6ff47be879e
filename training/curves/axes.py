"""What a curve runs over: a condition by its name, or any field of a scenario."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from trust_env.scenario import Scenario


@dataclass(frozen=True)
class Axis:
    """A condition: what it is, the values it takes unless others are given, and the fields that a value sets."""

    meaning: str
    values: Callable[[Scenario], Sequence[Any]]
    fields: Callable[[Scenario, Any], Mapping[str, Any]]


def _teams(scenario: Scenario) -> range:
    """All but one agent may be adversaries."""
    return range(scenario.n_agents)


def _team(scenario: Scenario, adversaries: Any) -> dict[str, Any]:
    """So many adversaries among as many agents as the scenario has."""
    if scenario.agents is not None:
        raise ValueError(f"adversaries: {scenario.name} lists its agents one by one; expected one with a `team`")
    if isinstance(adversaries, bool) or not isinstance(adversaries, int) or not 0 <= adversaries <= scenario.n_agents:
        expected = f"a whole number from 0 to {scenario.n_agents}, the agents of {scenario.name}"
        raise ValueError(f"adversaries = {adversaries!r}: expected {expected}")
    return {"team.n_adversaries": adversaries, "team.n_benign": scenario.n_agents - adversaries}


def _field(field: str, *more: str) -> Callable[[Scenario, Any], dict[str, Any]]:
    return lambda _, value: dict.fromkeys((field, *more), value)


AXES: dict[str, Axis] = {
    "adversaries": Axis("adversaries among the scenario's agents", _teams, _team),
    "p_detect": Axis(
        "probability of detection, of the sensors and as the tracker believes",
        lambda _: (0.5, 0.6, 0.7, 0.8, 0.9, 0.95),
        _field("sensor.p_detect", "tracker.p_detect"),
    ),
    "clutter": Axis(
        "natural false positives per m^2 and scan, and as the tracker believes",
        lambda s: tuple(f * s.sensor.clutter_density for f in (0.1, 1.0, 3.0, 10.0, 30.0)),
        _field("sensor.clutter_density", "tracker.beta_fp"),
    ),
    "spread": Axis(
        "radius of the disc in which agents are placed, m: the smaller, the more their FOVs overlap",
        lambda s: tuple(f * s.team.spread for f in (0.2, 0.6, 1.0, 1.4, 2.0)),
        _field("team.spread"),
    ),
    "slots": Axis(
        "false positives that an adversary may inject in a frame",
        lambda _: (1, 2, 4, 8),
        _field("injection.slots"),
    ),
}


def axis_of(name: str) -> Axis:
    """The condition of this name, else the scenario's field of this dotted path, which has no values of its own."""

    def no_values(scenario: Scenario) -> Sequence[Any]:
        raise ValueError(f"--over {name}: expected --values too, as it is none of {', '.join(AXES)}")

    return AXES.get(name) or Axis(f"the scenario's field {name}", no_values, _field(name))
