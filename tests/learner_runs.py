"""Random choices of learners."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

HORIZON = 6


def drawn(learners: Any, seed: int) -> np.ndarray:
    """Choices of every learner, uniform in the action space."""
    space = copy.deepcopy(learners.action_space)
    space.seed(seed)
    return np.array([space.sample() for _ in range(learners.num_learners)])


def play(learners: Any, frames: int, first: int = 0) -> list[tuple[Any, ...]]:
    """Observations, rewards and ends of some frames of random choices."""
    return [learners.step(drawn(learners, first + frame))[:3] for frame in range(frames)]


def assert_same(these: list[tuple[Any, ...]], those: list[tuple[Any, ...]]) -> None:
    for one, other in zip(these, those, strict=True):
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a, b)
