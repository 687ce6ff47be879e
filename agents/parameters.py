"""Checks of parameters of policies and views: each names the parameter, the value and what was expected."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Mapping
from numbers import Integral, Real
from typing import Any

from trust_env.errors import suggestion


def made(kind: str, name: str, make: Callable[..., Any], params: Mapping[str, Any]) -> Any:
    """`make(**params)`; ValueError for parameters that it does not take. `kind` is what messages call it."""
    signature = inspect.signature(make)
    known = [p.name for p in signature.parameters.values() if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    takes_all = any(p.kind is p.VAR_KEYWORD for p in signature.parameters.values())
    for key in params:
        if key not in known and not takes_all:
            hint = f"{suggestion(key, known)}it takes: {', '.join(known) or 'none'}"
            raise ValueError(f"{kind} {name!r} has no parameter {key!r}; {hint}")
    try:
        signature.bind(**params)
    except TypeError as error:
        raise ValueError(f"{kind} {name!r}: {error}; it takes: {', '.join(known) or 'none'}") from None
    return make(**params)


def refuse(policy: str, name: str, value: Any, expected: str) -> ValueError:
    """The error to raise for a parameter that does not fit."""
    return ValueError(f"{policy}: {name} = {value!r}: expected {expected}")


def whole(policy: str, name: str, value: Any, least: int) -> int:
    """A whole number of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise refuse(policy, name, value, f"a whole number of at least {least}")
    return int(value)


def whole_or_none(policy: str, name: str, value: Any, least: int, meaning: str) -> int | None:
    """A whole number of at least `least`, or None, which means what `meaning` says."""
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise refuse(policy, name, value, f"a whole number of at least {least}, or None: {meaning}")
    return int(value)


def share(policy: str, name: str, value: Any, zero: bool = False) -> float:
    """A number above 0 (or from 0 on, with `zero`) and at most 1."""
    number = _finite(value)
    if number is None or not (number >= 0.0 if zero else number > 0.0) or number > 1.0:
        raise refuse(
            policy, name, value, "a number from 0 to 1" if zero else "a number above 0 and at most 1"
        )
    return number


def share_or_none(policy: str, name: str, value: Any, meaning: str) -> float | None:
    """A number from 0 to 1, or None, which means what `meaning` says."""
    number = _finite(value)
    if value is not None and (number is None or not 0.0 <= number <= 1.0):
        raise refuse(policy, name, value, f"a number from 0 to 1, or None: {meaning}")
    return number


def length(policy: str, name: str, value: Any, unit: str) -> float:
    """A number of at least 0."""
    number = _finite(value)
    if number is None or number < 0.0:
        raise refuse(policy, name, value, f"a number of at least 0 ({unit})")
    return number


def length_or_none(policy: str, name: str, value: Any, unit: str, meaning: str) -> float | None:
    """A number of at least 0, or None, which means what `meaning` says."""
    number = _finite(value)
    if value is not None and (number is None or number < 0.0):
        raise refuse(policy, name, value, f"a number of at least 0 ({unit}), or None: {meaning}")
    return number


def one_of(policy: str, name: str, value: Any, known: Iterable[str]) -> str:
    """One of the known names."""
    names = tuple(known)
    if value not in names:
        hint = suggestion(value, names).strip()
        raise refuse(policy, name, value, f"one of {', '.join(names)}" + (f"; {hint}" if hint else ""))
    return value


def _finite(value: Any) -> float | None:
    """The value as a finite float; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
        return None
    return float(value)
