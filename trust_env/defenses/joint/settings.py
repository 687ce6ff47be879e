"""What the parameters of `joint_posterior` may be."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

_OPEN = "a number above 0 and below 1"
_PROBABILITY = "a number from 0 to below 1"
_RANGES: dict[str, str] = {
    **dict.fromkeys(("pi", "eps", "tau", "standing", "platform_share"), _OPEN),
    **dict.fromkeys(("kappa", "r", "gamma", "memory", "dormant", "natural", "gap", "platform_prior"), _PROBABILITY),
}
_SWITCHES = ("counts", "kinematics", "exactness", "departures", "edges")
_POSITIVE = ("standing_weight", "cap_dead", "cap_motion", "cap_fit", "cap_count")
MOST_CAP = 60.0  # nats: a cap that caps nothing


def check_settings(given: Mapping[str, Any]) -> None:
    """Raise ValueError for a parameter out of its range."""
    for name, expected in _RANGES.items():
        least = -1.0 if expected is _PROBABILITY else 0.0
        if not _is_number(given[name]) or not max(0.0, least) <= given[name] < 1.0 or given[name] == least:
            raise _invalid(given, name, expected)
    for name in _SWITCHES:
        if not isinstance(given[name], bool):
            raise _invalid(given, name, "True or False")
    for name in _POSITIVE:
        if not _is_number(given[name]) or not 0.0 < given[name] <= 1e6:
            raise _invalid(given, name, "a number above 0, at most 1e6")
    cap = given["cap_track"]
    if not _is_number(cap) or not 1.0 <= cap <= MOST_CAP:
        raise _invalid(given, "cap_track", f"a number of nats from 1 to {MOST_CAP:g}, which caps nothing")
    for name in ("alone", "together", "withheld"):
        if not _are_shares(given[name]):
            raise _invalid(given, name, "one to eight numbers above 0 and below 1, from the least to the greatest")
    if isinstance(given["most"], bool) or not isinstance(given["most"], int) or not 1 <= given["most"] <= 10:
        raise _invalid(given, "most", "a whole number from 1 to 10")


def _invalid(given: Mapping[str, Any], name: str, expected: str) -> ValueError:
    return ValueError(f"joint_posterior: {name} must be {expected}, not {given[name]!r}")


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _are_shares(values: Any) -> bool:
    if not isinstance(values, Sequence) or isinstance(values, str) or not 1 <= len(values) <= 8:
        return False
    return all(_is_number(v) and 0.0 < v < 1.0 for v in values) and list(values) == sorted(set(values))
