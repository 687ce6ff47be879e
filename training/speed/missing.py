"""Peers that are not installed here."""

from __future__ import annotations

import importlib


class MissingPeer(Exception):
    """A peer that cannot be timed here; the text says what it needs."""


def require(module: str, extra: str) -> None:
    """Raises `MissingPeer` where a module cannot be imported."""
    try:
        importlib.import_module(module)
    except ImportError:
        raise MissingPeer(f"{module} ({extra})") from None
