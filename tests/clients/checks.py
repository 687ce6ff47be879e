"""What the example of every library has to show."""

from __future__ import annotations

import numpy as np

from trust_env.training.examples import Outcome


def check_trained(outcome: Outcome, updates: int, learners: set[str]) -> None:
    """Losses are finite, the weights of all learners have changed, and the damage is one that can be."""
    assert len(outcome.losses) == updates
    assert np.isfinite(outcome.losses).all()
    assert set(outcome.changes) == learners
    for change in outcome.changes.values():
        assert np.isfinite(change).all()
        assert np.linalg.norm(change) > 1e-3
    assert 0.0 < sum(outcome.damage) < 20.0  # honest agents alone leave a few targets out
    assert str(outcome).startswith(f"{outcome.library}: {updates} updates, loss ")
