"""`path_trust`: trust as it is passed on from an anchor, from agent to agent."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.defenses.base import BuiltIn
from trust_env.defenses.checks import agent_index, number, whole
from trust_env.defenses.looks import VOTES, judge_by_votes, looks_at, reset_votes
from trust_env.world.tracking.track_store import list_confirmed

_FAMILIAR = 20.0  # looks together at which confidence is one half


class PathTrust(BuiltIn):
    """Trust along the best path from an anchor, over opinions from tracks seen together (theodorakopoulos2004-style).

    Two agents' opinion of each other is (t, c), trust t = (g + 1)/(n + 2) and confidence c = n/(n + 20), from n
    looks at the same track in the same frame, g of them alike; both age by `ageing` each frame. Along a path
    both multiply; the path of the best c counts, and of equal ones that of the best t. An agent's trust is t from
    the anchor; no opinion where no path leads. A track's trust is a moving average, over `window` frames with at
    least two lookers, of the share of hits, weighted by t c.

    anchor: the index of an agent that is trusted, to be given; ageing: in (0, 1]; window: frames, from 1 to 1000.
    Raises ValueError outside these ranges. Reconstructed after the idea of the publication, not its equations.
    """

    parameters: ClassVar = {"anchor": "i8", "ageing": "f8", "window": "i8 | frames"}
    memory: ClassVar = {
        **VOTES,
        "together": "f8 K K | n, looks of two agents at the same track",
        "alike": "f8 K K | g, of them those in which both hit or both miss",
        "trust": "f8 K | t from the anchor",
        "confidence": "f8 K | c from the anchor",
    }

    def __init__(self, anchor: int, ageing: float = 0.99, window: int = 10):
        self.anchor = whole("path_trust", "anchor", anchor, 0, 255)
        self.ageing = number("path_trust", "ageing", ageing, 0.0, 1.0, "(]")
        self.window = whole("path_trust", "window", window, 1, 1000)

    def params(self) -> dict[str, Any]:
        return {"anchor": self.anchor, "ageing": self.ageing, "window": self.window}

    def values(self, n_agents: int) -> dict[str, Any]:
        agent_index("path_trust", "anchor", self.anchor, n_agents)
        return self.params()

    @staticmethod
    @kernel
    def reset(world):
        """No two agents have seen anything together."""
        memory = world.path_trust
        reset_votes(memory, 0.0)
        for k in range(memory.weight.shape[0]):
            for other in range(memory.weight.shape[0]):
                memory.together[k, other], memory.alike[k, other] = 0.0, 0.0

    @staticmethod
    @kernel
    def judge(world):
        """Opinions, paths, then the verdict."""
        memory, verdict, listed = world.path_trust, world.verdict, list_confirmed(world)
        _compare_agents(world, listed)
        _follow_paths(world)
        for k in range(memory.weight.shape[0]):
            memory.weight[k] = memory.trust[k] * memory.confidence[k]
            verdict.agent_trust[k] = memory.trust[k] if memory.confidence[k] > 0.0 else np.nan
        judge_by_votes(world, memory, listed, memory.window)


@kernel
def _compare_agents(world, listed):
    """g and n of all pairs, after this frame."""
    memory, detected = world.path_trust, world.evidence.hit
    for k in range(memory.weight.shape[0]):
        for other in range(memory.weight.shape[0]):
            memory.together[k, other] *= memory.ageing
            memory.alike[k, other] *= memory.ageing
    for c in range(listed):
        j = world.scratch.listing[c]
        for k in range(memory.weight.shape[0]):
            for other in range(memory.weight.shape[0]):
                if k != other and looks_at(world, k, j) and looks_at(world, other, j):
                    memory.together[k, other] += 1.0
                    memory.alike[k, other] += detected[k, j] == detected[other, j]


@kernel
def _follow_paths(world):
    """t and c of the best path from the anchor to every agent: paths of one step, of two, ... (Bellman & Ford)."""
    memory, agents = world.path_trust, world.path_trust.weight.shape[0]
    for k in range(agents):
        memory.trust[k], memory.confidence[k] = 0.0, 0.0
    memory.trust[memory.anchor], memory.confidence[memory.anchor] = 1.0, 1.0
    for _ in range(agents - 1):
        for k in range(agents):
            for other in range(agents):
                n = memory.together[k, other]
                t = memory.trust[k] * (memory.alike[k, other] + 1.0) / (n + 2.0)
                c = memory.confidence[k] * n / (n + _FAMILIAR)
                best = memory.confidence[other]
                if c > best or (c == best and c > 0.0 and t > memory.trust[other]):
                    memory.trust[other], memory.confidence[other] = t, c
