"""Checks of parameters of policies and wrappers; errors name parameter, value and what was expected."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Mapping
from numbers import Integral, Real
from typing import Any

from trust_env import user_code
from trust_env.errors import suggestion


def construct(kind: str, name: str, make: Callable[..., Any], params: Mapping[str, Any]) -> Any:
    """`make(**params)`; ValueError for parameters that it does not take. `kind` is what messages call it."""
    signature = inspect.signature(make)
    declared = signature.parameters.values()
    known = [p.name for p in declared if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    takes_all = any(p.kind is p.VAR_KEYWORD for p in declared)
    for key in params:
        if key not in known and not takes_all:
            hint = f"{suggestion(key, known)}it takes: {', '.join(known) or 'none'}"
            raise ValueError(f"{kind} {name!r} has no parameter {key!r}; {hint}")
    try:
        signature.bind(**params)
    except TypeError as error:
        raise ValueError(f"{kind} {name!r}: {error}; it takes: {', '.join(known) or 'none'}") from None
    return user_code.construct(make, params)


def invalid(owner: str, name: str, value: Any, expected: str) -> ValueError:
    """The error to raise for a parameter that does not fit; `owner` is the policy's or the wrapper's name."""
    return ValueError(f"{owner}: {name} = {value!r}: expected {expected}")


def whole_number(owner: str, name: str, value: Any, least: int) -> int:
    """A whole number of at least `least`."""
    if not _is_whole_number(value) or value < least:
        raise invalid(owner, name, value, f"a whole number of at least {least}")
    return int(value)


def whole_number_or_none(owner: str, name: str, value: Any, least: int, meaning: str) -> int | None:
    """A whole number of at least `least`, or None, which means what `meaning` says."""
    if value is None:
        return None
    if not _is_whole_number(value) or value < least:
        raise invalid(owner, name, value, f"a whole number of at least {least}, or None: {meaning}")
    return int(value)


def fraction(owner: str, name: str, value: Any) -> float:
    """A number above 0 and at most 1."""
    number = _finite(value)
    if number is None or not 0.0 < number <= 1.0:
        raise invalid(owner, name, value, "a number above 0 and at most 1")
    return number


def fraction_or_none(owner: str, name: str, value: Any, meaning: str) -> float | None:
    """A number from 0 to 1, or None, which means what `meaning` says."""
    number = _finite(value)
    if value is not None and (number is None or not 0.0 <= number <= 1.0):
        raise invalid(owner, name, value, f"a number from 0 to 1, or None: {meaning}")
    return number


def non_negative(owner: str, name: str, value: Any, unit: str) -> float:
    """A number of at least 0."""
    number = _finite(value)
    if number is None or number < 0.0:
        raise invalid(owner, name, value, f"a number of at least 0 ({unit})")
    return number


def non_negative_or_none(owner: str, name: str, value: Any, unit: str, meaning: str) -> float | None:
    """A number of at least 0, or None, which means what `meaning` says."""
    number = _finite(value)
    if value is not None and (number is None or number < 0.0):
        raise invalid(owner, name, value, f"a number of at least 0 ({unit}), or None: {meaning}")
    return number


def angle(owner: str, name: str, value: Any) -> float:
    """A finite number, in radians."""
    number = _finite(value)
    if number is None:
        raise invalid(owner, name, value, "a number (rad)")
    return number


def true_or_false(owner: str, name: str, value: Any) -> bool:
    """True or False."""
    if not isinstance(value, bool):
        raise invalid(owner, name, value, "True or False")
    return value


def one_of(owner: str, name: str, value: Any, known: Iterable[str]) -> str:
    """One of the known names."""
    names = tuple(known)
    if value not in names:
        hint = suggestion(value, names).strip()
        raise invalid(owner, name, value, f"one of {', '.join(names)}" + (f"; {hint}" if hint else ""))
    return value


def _is_whole_number(value: Any) -> bool:
    return isinstance(value, Integral) and not isinstance(value, bool)


def _finite(value: Any) -> float | None:
    """The value as a finite float; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
        return None
    return float(value)
