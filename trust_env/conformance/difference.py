"""The first difference between two runs, in words. Equal means bit for bit; NaN equals NaN."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

import numpy as np

from trust_env.conformance.rollout import Frame

COMPARED = ("observations", "rewards", "terminations", "truncations", "infos", "agents")


def first_difference(first: Sequence[Frame], second: Sequence[Frame], names: tuple[str, str]) -> str | None:
    """Frame, field and values of the first difference, or None; `names`: of the two runs."""
    for a, b in zip_longest(first, second):
        if a is None or b is None:
            last = a or b
            assert last is not None
            return f"only {names[1] if a is None else names[0]} goes on to frame {last.number}"
        for field in COMPARED:
            found = difference(getattr(a, field), getattr(b, field))
            if found:
                path, left, right = found
                return f"frame {a.number}, {field}{path}: {left} in {names[0]}, {right} in {names[1]}"
    return None


def difference(a: Any, b: Any) -> tuple[str, str, str] | None:
    """Path, left and right value of the first difference between two nested values, or None."""
    if type(a) is not type(b):
        return "", f"{_abbreviate(a)} ({type(a).__name__})", f"{_abbreviate(b)} ({type(b).__name__})"
    if isinstance(a, dict):
        return _difference_of_dicts(a, b)
    if isinstance(a, (list, tuple)):
        if len(a) != len(b):
            return "", _abbreviate(a), _abbreviate(b)
        return _first_of((f"[{i}]", x, y) for i, (x, y) in enumerate(zip(a, b)))
    if isinstance(a, np.ndarray):
        return _difference_of_arrays(a, b)
    if type(a).__eq__ is object.__eq__:  # compares identities: a copy is never equal
        return _difference_of_dicts(getattr(a, "__dict__", {}), getattr(b, "__dict__", {}))
    return None if a == b or (a != a and b != b) else ("", _abbreviate(a), _abbreviate(b))


def _difference_of_dicts(a: dict[Any, Any], b: dict[Any, Any]) -> tuple[str, str, str] | None:
    if a.keys() != b.keys():
        return "", f"keys {_abbreviate(list(a))}", f"keys {_abbreviate(list(b))}"
    return _first_of((f"[{key!r}]", a[key], b[key]) for key in a)


def _difference_of_arrays(a: np.ndarray, b: np.ndarray) -> tuple[str, str, str] | None:
    if a.dtype != b.dtype or a.shape != b.shape:
        return "", f"{a.dtype}{list(a.shape)}", f"{b.dtype}{list(b.shape)}"
    if a.dtype == object:
        return difference(a.tolist(), b.tolist())
    unequal = np.argwhere((a != b) & ~((a != a) & (b != b)))
    if not len(unequal):
        return None
    index = tuple(int(i) for i in unequal[0])
    return f"[{', '.join(map(str, index))}]", repr(a[index].item()), repr(b[index].item())


def _first_of(members: Any) -> tuple[str, str, str] | None:
    """Of members, each a key in brackets, a left and a right value."""
    for key, x, y in members:
        found = difference(x, y)
        if found:
            return key + found[0], *found[1:]
    return None


def _abbreviate(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
