"""Errors that help: what was given, what is known, and the nearest known name."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that `name` was most likely meant to be, or None when nothing comes close."""
    by_folded = {k.lower().replace("-", "_"): k for k in known}
    found = get_close_matches(name.lower().replace("-", "_"), by_folded, n=1, cutoff=0.6)
    return by_folded[found[0]] if found else None


def suggestion(name: object, known: Iterable[str]) -> str:
    """`did you mean 'trust'? ` or nothing; ready to stand inside a sentence."""
    match = nearest(name, known) if isinstance(name, str) else None
    return f"did you mean {match!r}? " if match else ""


def unknown_name(kind: str, name: str, known: Iterable[str]) -> ValueError:
    """The error to raise for a name that a registry lacks; `kind` says which registry, such as "defense"."""
    names = sorted(known)
    return ValueError(
        f"unknown {kind} {name!r}; {suggestion(name, names)}known: {', '.join(names) or 'none'}"
    )
