"""`score_asymmetry`: a track is hidden when an agent that should see it hits it too rarely to be believed."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.defenses.base import BuiltIn
from trust_env.defenses.binomial import binomial_cdf, rounded
from trust_env.defenses.checks import number, whole
from trust_env.defenses.looks import LOOKS, count_looks, forget_all

_LEAST_LOOKS = 3


class ScoreAsymmetry(BuiltIn):
    """A track is hidden when too few hits of its watchers contradict it (hallyburton2023-style). No numbers.

    p_k = P[Bin(n, P_D) ≤ h] of each agent with at least three looks n, of them h hits; hidden while the
    (`l` + 1)-th smallest is below a / (2 watchers). With l = 0 a single agent that suppresses its detections
    hides a track. h and n forget by γ at each look and are rounded.

    l: agents that may contradict in vain, from 0; a: in (0, 1); gamma: in [0.7, 1]. Raises ValueError outside
    these ranges.
    """

    parameters: ClassVar = {"l": "i8", "a": "f8", "gamma": "f8"}
    memory: ClassVar = LOOKS
    scratch: ClassVar = {"p": "f8 K | of the agents, of one track"}

    def __init__(self, l: int = 0, a: float = 1e-3, gamma: float = 0.95):  # noqa: E741
        self._params = {
            "l": whole("score_asymmetry", "l", l, 0, 255),
            "a": number("score_asymmetry", "a", a, 0.0, 1.0, "()"),
            "gamma": number("score_asymmetry", "gamma", gamma, 0.7, 1.0),
        }

    def params(self) -> dict[str, Any]:
        return dict(self._params)

    def values(self, n_agents: int) -> dict[str, Any]:
        return self._params

    @staticmethod
    @kernel
    def reset(world):
        """Nothing counted."""
        forget_all(world.score_asymmetry)

    @staticmethod
    @kernel
    def judge(world):
        """Which confirmed tracks are hidden."""
        for c in range(count_looks(world, world.score_asymmetry, world.score_asymmetry.gamma)):
            j = world.scratch.listing[c]
            watchers = _probabilities(world, j)
            contradicted = watchers > world.score_asymmetry.l
            if contradicted:
                least = _smallest(world.score_asymmetry.p, world.score_asymmetry.l)
                contradicted = least < world.score_asymmetry.a / (2.0 * watchers)
            world.verdict.publish[j] = not contradicted


@kernel
def _probabilities(world, j):
    """p[K] of a track, 2 of those that do not watch it; returns how many do."""
    memory, watchers = world.score_asymmetry, 0
    for k in range(memory.p.shape[0]):
        n = rounded(memory.looks[k, j])
        memory.p[k] = 2.0
        if n >= _LEAST_LOOKS:
            memory.p[k] = binomial_cdf(rounded(memory.hits[k, j]), n, world.agents.believed_p_detect[k])
            watchers += 1
    return watchers


@kernel
def _smallest(values, place):
    """The value that has `place` smaller ones before it; overwrites the values."""
    least = np.inf
    for _ in range(place + 1):
        at = np.argmin(values)
        least = values[at]
        values[at] = np.inf
    return least
