"""Torch's threads, the global random states and the values of tensors: set, saved and restored."""

from __future__ import annotations

import contextlib
import random
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import torch as th


@contextlib.contextmanager
def isolated_torch(threads: int) -> Iterator[None]:
    """Torch with so many threads in the block; after it, global random states and threads are as before."""
    random_state = get_random_state()
    try:
        with torch_threads(threads):
            yield
    finally:
        set_random_state(random_state)


@contextlib.contextmanager
def torch_threads(threads: int) -> Iterator[None]:
    """Torch with so many threads in the block."""
    before = th.get_num_threads()
    th.set_num_threads(threads)
    try:
        yield
    finally:
        th.set_num_threads(before)


def get_random_state() -> dict[str, Any]:
    """The states of Python's, NumPy's and torch's global generators, which Stable-Baselines3 draws from."""
    return {
        "python": random.getstate(),
        "numpy": np.random.get_state(),  # noqa: NPY002
        "torch": th.get_rng_state().numpy(),
    }


def set_random_state(state: Mapping[str, Any]) -> None:
    """Restore what `get_random_state` returned."""
    random.setstate(state["python"])
    np.random.set_state(state["numpy"])  # noqa: NPY002
    th.set_rng_state(th.from_numpy(state["torch"].copy()))


def to_arrays(tree: Any) -> Any:
    """The same tree with arrays, copied, in place of tensors."""
    if isinstance(tree, Mapping):
        return {key: to_arrays(value) for key, value in tree.items()}
    if isinstance(tree, (list, tuple)):
        return type(tree)(to_arrays(value) for value in tree)
    return tree.detach().cpu().numpy().copy() if isinstance(tree, th.Tensor) else tree


def to_tensors(tree: Any) -> Any:
    """The same tree with tensors, copied, in place of arrays."""
    if isinstance(tree, dict):
        return {key: to_tensors(value) for key, value in tree.items()}
    if isinstance(tree, (list, tuple)):
        return type(tree)(to_tensors(value) for value in tree)
    return th.from_numpy(tree.copy()) if isinstance(tree, np.ndarray) else tree
