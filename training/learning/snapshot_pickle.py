"""Pickles for snapshots of objects with a memory of their own: a user's own defense, policies.

Objects that both sides have anyway (a scenario, its tables) are left out and put back as the same object,
because policies compare them by identity. Unpickling can run code: for snapshots of one's own only.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Sequence
from typing import Any


def dump(objects: Any, shared: Sequence[Any]) -> bytes:
    """Bytes of `objects` without those in `shared`."""
    file = io.BytesIO()
    _Pickler(file, shared).dump(objects)
    return file.getvalue()


def load(data: bytes, shared: Sequence[Any]) -> Any:
    """The objects again; ValueError where their code is no longer what it was."""
    try:
        return _Unpickler(io.BytesIO(data), shared).load()
    except (ImportError, AttributeError, pickle.UnpicklingError) as fault:
        raise ValueError(
            f"the snapshot's policies or defense cannot be restored: {fault}; "
            "expected the same files as when it was taken"
        ) from fault


class _Pickler(pickle.Pickler):
    def __init__(self, file: io.BytesIO, shared: Sequence[Any]):
        super().__init__(file)
        self._shared = shared

    def persistent_id(self, obj: Any) -> int | None:
        return next((i for i, shared in enumerate(self._shared) if obj is shared), None)


class _Unpickler(pickle.Unpickler):
    def __init__(self, file: io.BytesIO, shared: Sequence[Any]):
        super().__init__(file)
        self._shared = shared

    def persistent_load(self, pid: int) -> Any:
        return self._shared[pid]
