"""What the parameters of built-in defenses may be: the value, or a ValueError that names defense, field, value and
what was expected.
"""

from __future__ import annotations

import math
from typing import Any


def number(defense: str, name: str, value: Any, low: float, high: float = math.inf, ends: str = "[]") -> float:
    """The value as a float, if it is a number from `low` to `high`; `ends` as in "[)": without `high` itself."""
    known = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    if known and low <= value <= high and (ends[0] == "[" or value > low) and (ends[1] == "]" or value < high):
        return float(value)
    limits = f"in {ends[0]}{low:g}, {high:g}{ends[1]}"
    if high == math.inf:
        limits = f"{'from' if ends[0] == '[' else 'above'} {low:g}"
    raise ValueError(f"{defense}: {name} must be a number {limits}, not {value!r}")


def whole(defense: str, name: str, value: Any, low: int, high: int) -> int:
    """The value, if it is a whole number from `low` to `high`."""
    if isinstance(value, int) and not isinstance(value, bool) and low <= value <= high:
        return value
    raise ValueError(f"{defense}: {name} must be a whole number from {low} to {high}, not {value!r}")


def choice(defense: str, name: str, value: Any, choices: tuple[Any, ...]) -> int:
    """The place of the value among the choices."""
    if any(type(value) is type(one) and value == one for one in choices):
        return choices.index(value)
    raise ValueError(f"{defense}: {name} must be {' or '.join(map(repr, choices))}, not {value!r}")


def agent_index(defense: str, name: str, value: Any, n_agents: int) -> int:
    """The value, if it is the index of an agent."""
    return whole(defense, name, value, 0, n_agents - 1)


def beta_prior(defense: str, name: str, value: Any) -> tuple[float, float]:
    """(α, β) of a prior, both above 0."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise ValueError(f"{defense}: {name} must be two numbers above 0, α and β, not {value!r}")
    alpha, beta = (number(defense, f"{name}[{i}]", part, 0.0, ends="(]") for i, part in enumerate(value))
    return alpha, beta
