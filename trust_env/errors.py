"""Errors for unknown names: the nearest known name, and all that are known."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from numbers import Integral
from typing import Any


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name most similar to `name`, or None when none is similar."""
    by_folded = {k.lower().replace("-", "_"): k for k in known}
    matches = get_close_matches(name.lower().replace("-", "_"), by_folded, n=1, cutoff=0.6)
    return by_folded[matches[0]] if matches else None


def suggestion(name: object, known: Iterable[str]) -> str:
    """`did you mean 'trust'? `, with the space after it, or an empty text."""
    match = nearest(name, known) if isinstance(name, str) else None
    return f"did you mean {match!r}? " if match else ""


def unknown_name(kind: str, name: str, known: Iterable[str]) -> ValueError:
    """The error to raise for a name that a registry lacks; `kind` says which registry, such as "defense"."""
    names = sorted(known)
    return ValueError(f"unknown {kind} {name!r}; {suggestion(name, names)}known: {', '.join(names) or 'none'}")


def positive_int(name: str, value: Any) -> int:
    """The value as an int; ValueError if it is not a whole number of at least 1."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < 1:
        raise ValueError(f"{name} must be a whole number of at least 1; got {value!r}")
    return int(value)
