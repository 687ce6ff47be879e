"""Snapshots of learners: what they continue bit for bit, and which ones raise."""

from __future__ import annotations

import pickle
import sys
from typing import Any

import numpy as np
import pytest
from learner_runs import assert_same, play

from trust_env.training.learning.learners import Learners

pytestmark = pytest.mark.core


class Remembering:
    """A user's own defense with memory: it publishes every other frame."""

    def reset(self, shape: Any, worlds: np.ndarray) -> None:
        self.shape, self.frames = shape, 0

    def update(self, evidence: Any) -> Any:
        from trust_env.defenses import Verdict

        self.frames += 1
        return Verdict(publish=np.full(evidence.status.shape, self.frames % 2 == 0))


@pytest.mark.parametrize(
    ("defense", "others", "role"),
    [
        ("trust", {}, "adversary"),
        ("trust", {"adversary_1": "false_positive(motion=random_walk)", "benign": "suppress"}, "adversary_0"),
        (Remembering, {"benign": "random"}, "adversary"),
    ],
)
@pytest.mark.parametrize("wrapper", ["phantoms", "grid", "by_need"])
def test_a_snapshot_continues_bit_for_bit(defense: Any, others: dict[str, Any], role: str, wrapper: str) -> None:
    def build() -> Learners:
        own = defense() if isinstance(defense, type) else defense
        return Learners("patrol", own, 3, wrapper, others, max_cycles=9, learner_role=role, stagger=True)

    learners = build()
    learners.reset(2)
    play(learners, 13)
    state = pickle.loads(pickle.dumps(learners.get_state()))
    expected = play(learners, 15, first=13)
    for fresh in (build(), learners):
        fresh.set_state(state)
        assert_same(play(fresh, 15, first=13), expected)


def test_a_snapshot_of_missing_code_raises(tmp_path: Any) -> None:
    file = tmp_path / "mine.py"
    file.write_text("class Mine:\n    def reset(self, *_): ...\n    def update(self, *_): ...\n")
    learners = Learners("trio", f"{file}:Mine")
    learners.reset(0)
    state = learners.get_state()
    learners.set_state(state)
    del sys.modules[type(learners.env.defense).__module__]
    with pytest.raises(ValueError, match="expected the same files as when it was taken"):
        learners.set_state(state)


def test_a_snapshot_of_other_learners_raises() -> None:
    with pytest.raises(ValueError, match="the snapshot holds worlds of"):
        Learners("trio", num_worlds=2).set_state(Learners("trio", num_worlds=3).get_state())
