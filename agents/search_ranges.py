"""What a search may try of a parameter. The ranges of an attack stand in its class, `search_ranges`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple, TypeAlias

from trust_env.scenario import Scenario


class Range(NamedTuple):
    """Numbers from `low` to `high`, both included."""

    low: float
    high: float
    whole: bool = False  # whole numbers only
    none: float | None = None  # the number that the default None stands for, where there is one


# By parameter: a range, or a list of values to choose from.
SearchRanges: TypeAlias = Mapping[str, Range | tuple[str | bool, ...]]


def start_range(scenario: Scenario) -> Range:
    """Honest frames before an attack."""
    return Range(0, half_episode(scenario), whole=True)


def hit_rate_range(scenario: Scenario) -> Range:
    """Probability that a phantom is reported; None is the sensor's P_D."""
    return Range(0.5, 1.0, none=scenario.sensor.p_detect)


def phantom_range(scenario: Scenario, most: int) -> Range:
    """Number of phantoms; None is as many as one adversary can report."""
    return Range(1, max(1, most), whole=True, none=scenario.injection.slots)


def noise_range(scenario: Scenario) -> Range:
    """Standard deviation (m) added to reports, up to three times that of the sensor, which None stands for."""
    sigma = noise_deviation(scenario)
    return Range(0.0, 3.0 * sigma, none=sigma)


def noise_deviation(scenario: Scenario) -> float:
    """m, standard deviation of the noise of the scenario's sensor, of x and of y alike."""
    (xx, _), (_, yy) = scenario.sensor.covariance
    return math.sqrt(0.5 * (xx + yy))


def half_episode(scenario: Scenario) -> int:
    """Half of the horizon, and at least 2, frames."""
    return max(2, scenario.horizon // 2)
