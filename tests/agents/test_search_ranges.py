"""The ranges that attacks declare for a search: complete, playable at both ends, and set by the scenario."""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
import pytest
from attack_runs import play

from trust_env.agents import POLICIES, build_policy, sufficient_knowledge
from trust_env.agents.search_ranges import Range
from trust_env.scenario import load_scenario

pytestmark = pytest.mark.core

SCENARIOS = ("trio(horizon=3)", "patrol(knowledge=poses)", "theorem", "case1")
WITHOUT = {"honest", "random", "learned"}  # nothing to search: no parameters, or weights
ATTACKS = [name for name in POLICIES if name not in WITHOUT]


def ranges(name: str, scenario: Any = "patrol") -> Any:
    return POLICIES[name].search_ranges(load_scenario(scenario))


@pytest.mark.parametrize("name", POLICIES)
def test_an_attack_declares_a_range_for_every_parameter_that_is_searched(name: str) -> None:
    attack = POLICIES[name]
    parameters = set(inspect.signature(attack).parameters) - {*attack.policy_parameters, *attack.unsearched}
    assert set(ranges(name)) == (set() if name in WITHOUT else parameters)


@pytest.mark.parametrize("scenario", SCENARIOS)
@pytest.mark.parametrize("name", ATTACKS)
def test_ranges_are_finite_and_ordered(name: str, scenario: str) -> None:
    for values in ranges(name, scenario).values():
        if isinstance(values, Range):
            assert np.isfinite([values.low, values.high]).all() and values.low <= values.high
            assert not values.whole or (type(values.low), type(values.high)) == (int, int)
        else:
            assert len(set(values)) == len(values) > 1


@pytest.mark.parametrize("name", ATTACKS)
def test_ranges_hold_the_defaults(name: str) -> None:
    for parameter, values in ranges(name).items():
        default = inspect.signature(POLICIES[name]).parameters[parameter].default
        if not isinstance(values, Range):
            assert default in values
        elif default is not None:
            assert values.low <= default <= values.high


@pytest.mark.parametrize("scenario", SCENARIOS)
@pytest.mark.parametrize("name", ATTACKS)
@pytest.mark.parametrize("end", [0, -1])
def test_both_ends_of_the_ranges_can_be_played(name: str, scenario: str, end: int) -> None:
    found = {
        key: (values.low, values.high)[end] if isinstance(values, Range) else values[end]
        for key, values in ranges(name, scenario).items()
    }
    attack = build_policy(f"{name}({', '.join(f'{key}={value}' for key, value in found.items())})")
    world = load_scenario(scenario)
    world = load_scenario(world, knowledge=sufficient_knowledge(world, attack))
    ((_, actions),) = play(world, attack, 1)
    assert np.isfinite(actions).all()


def test_ranges_are_those_of_the_scenario() -> None:
    patrol = load_scenario("patrol")
    slots = patrol.injection.slots
    own, shared = ranges("false_positive"), ranges("fov_aware")
    assert own["n"] == Range(1, slots, whole=True, none=slots)
    assert shared["n"] == Range(1, 2 * slots, whole=True, none=slots)  # two adversaries
    given = POLICIES["fov_aware"].search_ranges(patrol, share=False)
    assert given["n"] == Range(1, slots, whole=True, none=slots)
    assert own["speed"].high == 2.0 * patrol.targets.speed[1]
    assert own["start"].high == ranges("on_off")["period"].high == 100  # half of the horizon
    assert own["hit_rate"].none == patrol.sensor.p_detect
    assert shared["max_honest"] == Range(0, 3, whole=True, none=3)  # three benign agents
