"""`majority`: the expected agents vote on every track; an agent is as good as it agrees with the outcome."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from trust_env.compiled.jit import compiled
from trust_env.defenses.base import BuiltIn
from trust_env.world.evidence import list_confirmed
from trust_env.world.fields import F, flags1, flags2, floats1, floats2, floats3, ints1, whole

QUOTA = 0


class Majority(BuiltIn):
    """Vote of the expected agents, F = expected and H = detected, over a sliding window.

    A track's trust is the mean over the window's frames of Σ_k F·H / Σ_k F; it is shown when that exceeds
    `q`. An agent's trust is its rate of agreement, over the window, with what was decided on the tracks that
    it was expected to see.

    window: frames, from 1 to 1000; q: share of the votes, in [0, 1). Raises ValueError outside these ranges.
    """

    code: ClassVar[int] = 2

    def __init__(self, window: int = 10, q: float = 0.5):
        if not isinstance(window, int) or not 1 <= window <= 1000:
            raise ValueError(
                f"majority: window must be a whole number of frames from 1 to 1000, not {window!r}"
            )
        if not isinstance(q, (int, float)) or not 0.0 <= q < 1.0:
            raise ValueError(f"majority: q must be a share of the votes in [0, 1), not {q!r}")
        self.history, self.q = window, float(q)

    def params(self) -> dict[str, Any]:
        return {"window": self.history, "q": self.q}

    def pack(self, n_agents: int) -> tuple[np.ndarray, np.ndarray]:
        values, priors = super().pack(n_agents)
        values[QUOTA] = self.q
        return values, priors


@compiled
def reset_majority(world):
    agreement = floats3(world, F.agreement)  # [H, K, 2]  agreements, looks
    for h in range(agreement.shape[0]):
        for k in range(agreement.shape[1]):
            agreement[h, k, 0], agreement[h, k, 1] = 0.0, 0.0
    for j in range(ints1(world, F.belief_id).shape[0]):
        ints1(world, F.belief_id)[j] = -1


@compiled
def judge_majority(world):
    listed, columns = list_confirmed(world), ints1(world, F.listing)
    vote, agreement = floats2(world, F.vote), floats3(world, F.agreement)
    now = whole(world, F.frame) % vote.shape[0]
    for k in range(agreement.shape[1]):
        agreement[now, k, 0], agreement[now, k, 1] = 0.0, 0.0
    for c in range(listed):
        _count_votes(world, columns[c], now)
    for k in range(agreement.shape[1]):
        agreed, looks = 0.0, 0.0
        for h in range(agreement.shape[0]):
            agreed += agreement[h, k, 0]
            looks += agreement[h, k, 1]
        if looks > 0.0:
            rate = agreed / looks
            floats1(world, F.agent_trust)[k], floats1(world, F.agent_trust_var)[k] = (
                rate,
                rate * (1.0 - rate) / looks,
            )


@compiled
def _count_votes(world, j, now):
    """Trust of one track, whether it is shown, and who agrees."""
    expected, detected = flags2(world, F.expected), flags2(world, F.detected)
    vote, belief_id, track_id = floats2(world, F.vote), ints1(world, F.belief_id), ints1(world, F.track_id)
    if belief_id[j] != track_id[j]:
        belief_id[j] = track_id[j]
        for h in range(vote.shape[0]):
            vote[h, j] = np.nan
    looks, yes = 0, 0
    for k in range(expected.shape[0]):
        looks += expected[k, j]
        yes += expected[k, j] and detected[k, j]
    vote[now, j] = yes / looks if looks > 0 else np.nan
    total, frames, squares = 0.0, 0, 0.0
    for h in range(vote.shape[0]):
        if not np.isnan(vote[h, j]):
            total += vote[h, j]
            squares += vote[h, j] ** 2
            frames += 1
    if frames == 0:
        return
    mean = total / frames
    shown = mean > floats1(world, F.defense_params)[QUOTA]
    floats1(world, F.track_trust)[j], floats1(world, F.track_trust_var)[j] = (
        mean,
        max(0.0, squares / frames - mean * mean) / frames,
    )
    flags1(world, F.publish)[j] = shown
    for k in range(expected.shape[0]):
        if expected[k, j]:
            floats3(world, F.agreement)[now, k, 0] += detected[k, j] == shown
            floats3(world, F.agreement)[now, k, 1] += 1.0
