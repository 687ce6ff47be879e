"""`binary_beta`: agents are as good as they agree with the majority."""

from __future__ import annotations

from typing import Any, ClassVar

from trust_env.compiled.kernels import kernel
from trust_env.defenses.base import BuiltIn
from trust_env.defenses.checks import whole
from trust_env.defenses.looks import VOTES, believe_agent, judge_by_votes, looks_at, reset_votes, vote
from trust_env.world.tracking.track_store import list_confirmed


class BinaryBeta(BuiltIn):
    """Beta trust from counts of agreement with the majority of those that look at the same track (wang2006-style).

    A look is a track expected in the FOV, or hit. An agent's trust is (s + 1) / (s + f + 2), s and f counts
    over the episode of looks with and against the majority; ties, and looks of one agent alone, do not count. A
    track's trust is a moving average of the share of hits, over the frames with at least two lookers.

    window: frames of that average, from 1 to 1000. Raises ValueError outside. Reconstructed after the idea of
    binary beta reputation, not after its equations.
    """

    parameters: ClassVar = {"window": "i8 | frames"}
    memory: ClassVar = {**VOTES, "counts": "f8 K 2 | s, f"}

    def __init__(self, window: int = 10):
        self.window = whole("binary_beta", "window", window, 1, 1000)

    def params(self) -> dict[str, Any]:
        return {"window": self.window}

    def values(self, n_agents: int) -> dict[str, Any]:
        return self.params()

    @staticmethod
    @kernel
    def reset(world):
        """Nothing counted; all votes weigh the same, for good."""
        reset_votes(world.binary_beta, 1.0)
        for k in range(world.binary_beta.counts.shape[0]):
            world.binary_beta.counts[k, 0], world.binary_beta.counts[k, 1] = 0.0, 0.0

    @staticmethod
    @kernel
    def judge(world):
        """Who was with the majority, in every track; then the verdict."""
        listed = list_confirmed(world)
        for c in range(listed):
            _count(world, world.scratch.listing[c])
        for k in range(world.binary_beta.counts.shape[0]):
            believe_agent(world, k, world.binary_beta.counts[k, 0] + 1.0, world.binary_beta.counts[k, 1] + 1.0)
        judge_by_votes(world, world.binary_beta, listed, world.binary_beta.window)


@kernel
def _count(world, j):
    """s and f of those that look at a track."""
    counts = world.binary_beta.counts
    looks, _, hits = vote(world, j, world.binary_beta.weight)
    if looks < 2 or 2.0 * hits == looks:
        return
    for k in range(counts.shape[0]):
        if looks_at(world, k, j):
            agrees = world.evidence.hit[k, j] == (2.0 * hits > looks)
            counts[k, 0 if agrees else 1] += 1.0
