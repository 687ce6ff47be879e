"""What the parameters of `joint_posterior` may be."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from trust_env.defenses.checks import choice, number, whole

_NAME = "joint_posterior"
_OPEN = ("pi", "eps", "tau", "standing", "platform_share")
_FROM_ZERO = ("kappa", "r", "gamma", "memory", "dormant", "natural", "gap", "platform_prior")
_SWITCHES = ("counts", "kinematics", "exactness", "departures", "edges")
_CAPS = ("cap_dead", "cap_motion", "cap_fit", "cap_count")
_GRIDS = ("alone", "together", "withheld")
LEAST_CAP, MOST_CAP = 1.0, 60.0  # nats; the least of a track, and what caps nothing


def check_settings(given: Mapping[str, Any]) -> None:
    """Raise ValueError for a parameter out of its range."""
    for name in _OPEN:
        number(_NAME, name, given[name], 0.0, 1.0, ends="()")
    for name in _FROM_ZERO:
        number(_NAME, name, given[name], 0.0, 1.0, ends="[)")
    for name in _SWITCHES:
        choice(_NAME, name, given[name], (False, True))
    for name in _CAPS:
        number(_NAME, name, given[name], 0.0, MOST_CAP)
    number(_NAME, "standing_weight", given["standing_weight"], 0.0, 1e6, ends="(]")
    number(_NAME, "cap_track", given["cap_track"], LEAST_CAP, MOST_CAP)
    whole(_NAME, "most", given["most"], 1, 10)
    for name in _GRIDS:
        _check_grid(name, given[name])


def _check_grid(name: str, values: Any) -> None:
    """One to eight shares in rising order."""
    if not isinstance(values, (list, tuple)) or not 1 <= len(values) <= 8 or list(values) != sorted(set(values)):
        raise ValueError(f"{_NAME}: {name} must be a list of 1 to 8 rising numbers, not {values!r}")
    for i, value in enumerate(values):
        number(_NAME, f"{name}[{i}]", value, 0.0, 1.0, ends="()")
