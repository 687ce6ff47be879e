"""What a search may try: the ranges of the attacks' parameters. `training.search` tunes them.

A high end that depends on the scenario is the name of a limit, see `limits`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from trust_env.agents.attacks.false_positive import MOTIONS
from trust_env.agents.attacks.suppression import CHOICES
from trust_env.scenario import Scenario


class Range(NamedTuple):
    """Numbers from `low` to `high`, both included; what the default None stands for, where it is a number."""

    low: float
    high: float | str
    whole: bool = False
    none: float | str | None = None


START = Range(0, "half_episode", whole=True)
HIT_RATE = Range(0.5, 1.0, none="p_detect")
INNER = ("false_positive", "optimal_false_positive", "suppress", "fov_aware")  # with ranges of their own

RANGES: dict[str, dict[str, Range | tuple[Any, ...]]] = {
    "false_positive": {
        "n": Range(1, "slots", whole=True, none="slots"),
        "motion": MOTIONS,
        "speed": Range(0.0, "speed"),
        "start": START,
        "period": Range(1, 5, whole=True),
        "hit_rate": HIT_RATE,
    },
    "optimal_false_positive": {
        "n": Range(1, "coalition_slots", whole=True, none="slots"),
        "start": START,
        "hit_rate": HIT_RATE,
    },
    "suppress": {"fraction": Range(0.05, 1.0), "choice": CHOICES, "start": START},
    "fov_aware": {
        "max_honest": Range(0, "benign", whole=True, none="benign"),
        "n": Range(1, "coalition_slots", whole=True, none="slots"),
        "start": START,
        "hit_rate": HIT_RATE,
    },
    "sleeper": {"start": START, "inner": INNER},
    "on_off": {"duty": Range(0.05, 1.0), "period": Range(2, "half_episode", whole=True), "inner": INNER},
}


def limits(scenario: Scenario) -> Mapping[str, float]:
    """What a scenario sets: of one adversary, of all of them, m/s, frames, agents, a probability."""
    adversaries = [k for k, role in enumerate(scenario.roles) if role == "adversary"]
    fastest = scenario.targets.speed[1]
    if scenario.targets.data is not None:
        fastest = math.sqrt(scenario.tracker.initial_velocity_variance)
    return {
        "slots": scenario.injection.slots,
        "coalition_slots": scenario.injection.slots * max(1, len(adversaries)),
        "speed": 2.0 * fastest,
        "half_episode": max(2, scenario.horizon // 2),
        "benign": scenario.n_agents - len(adversaries),
        "p_detect": scenario.sensor.p_detect,
    }


def resolved(given: Range, scenario: Scenario) -> Range:
    """The range with numbers in place of names."""
    known = limits(scenario)
    high = known[given.high] if isinstance(given.high, str) else given.high
    none = known[given.none] if isinstance(given.none, str) else given.none
    return given._replace(high=max(given.low, high), none=none)
