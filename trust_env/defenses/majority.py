"""`majority`: the expected agents vote on every track; an agent is as good as it agrees with the outcome."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.defenses.base import BuiltIn
from trust_env.defenses.checks import number, whole
from trust_env.world.tracking.track_store import list_confirmed


class Majority(BuiltIn):
    """Vote of the expected agents, F = expected and H = detected, over a sliding window.

    A track's trust is the mean over the window's frames of Σ_k F·H / Σ_k F; it is shown when that exceeds
    `q`. An agent's trust is its rate of agreement, over the window, with what was decided on the tracks that
    it was expected to see.

    window: frames, from 1 to 1000; q: share of the votes, in [0, 1). Raises ValueError outside these ranges.
    """

    parameters: ClassVar = {"q": "f8"}
    memory: ClassVar = {
        "track_id": "i8 J | whose votes these are",
        "vote": "f8 H J | share of the expected agents that detected the track; NaN: none was",
        "agreement": "f8 H K 2 | agreements, looks",
    }

    def __init__(self, window: int = 10, q: float = 0.5):
        self.window = whole("majority", "window", window, 1, 1000)
        self.q = number("majority", "q", q, 0.0, 1.0, "[)")

    def params(self) -> dict[str, Any]:
        return {"window": self.window, "q": self.q}

    def values(self, n_agents: int) -> dict[str, Any]:
        return {"q": self.q}

    def lengths(self, n_agents: int) -> dict[str, int]:
        return {"H": self.window}

    @staticmethod
    @kernel
    def reset(world):
        """No votes yet."""
        memory = world.majority
        for h in range(memory.agreement.shape[0]):
            for k in range(memory.agreement.shape[1]):
                memory.agreement[h, k, 0], memory.agreement[h, k, 1] = 0.0, 0.0
        for j in range(memory.track_id.shape[0]):
            memory.track_id[j] = -1

    @staticmethod
    @kernel
    def judge(world):
        """Trust of every confirmed track, whether it is shown, and how far each agent agrees with that."""
        agreement, verdict = world.majority.agreement, world.verdict
        now = world.clock.frame % agreement.shape[0]
        for k in range(agreement.shape[1]):
            agreement[now, k, 0], agreement[now, k, 1] = 0.0, 0.0
        for c in range(list_confirmed(world)):
            _count_votes(world, world.scratch.listing[c], now)
        for k in range(agreement.shape[1]):
            agreed, looks = 0.0, 0.0
            for h in range(agreement.shape[0]):
                agreed += agreement[h, k, 0]
                looks += agreement[h, k, 1]
            if looks > 0.0:
                rate = agreed / looks
                verdict.agent_trust[k], verdict.agent_trust_var[k] = rate, rate * (1.0 - rate) / looks


@kernel
def _count_votes(world, j, now):
    """Trust of one track, whether it is shown, and who agrees."""
    memory, evidence, verdict = world.majority, world.evidence, world.verdict
    if memory.track_id[j] != world.tracks.id[j]:
        memory.track_id[j] = world.tracks.id[j]
        for h in range(memory.vote.shape[0]):
            memory.vote[h, j] = np.nan
    memory.vote[now, j] = _vote(world, j)
    total, frames, squares = 0.0, 0, 0.0
    for h in range(memory.vote.shape[0]):
        if not np.isnan(memory.vote[h, j]):
            total += memory.vote[h, j]
            squares += memory.vote[h, j] ** 2
            frames += 1
    if frames == 0:
        return
    mean = total / frames
    verdict.track_trust[j] = mean
    verdict.track_trust_var[j] = max(0.0, squares / frames - mean * mean) / frames
    verdict.publish[j] = mean > memory.q
    for k in range(evidence.expected.shape[0]):
        if evidence.expected[k, j]:
            memory.agreement[now, k, 0] += evidence.detected[k, j] == verdict.publish[j]
            memory.agreement[now, k, 1] += 1.0


@kernel
def _vote(world, j):
    """Share of the agents expected to see the track that detect it; NaN where none is expected."""
    evidence, looks, yes = world.evidence, 0, 0
    for k in range(evidence.expected.shape[0]):
        looks += evidence.expected[k, j]
        yes += evidence.expected[k, j] and evidence.detected[k, j]
    return yes / looks if looks > 0 else np.nan
