"""`cusum`: alarms for agents that miss too much of what others see, or whose hits are too good or too bad."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.defenses.base import BuiltIn
from trust_env.defenses.checks import number, whole
from trust_env.defenses.looks import VOTES, judge_by_votes, looks_at, reset_votes
from trust_env.world.tracking.track_store import list_confirmed

_HITS = 30  # of which the sum of d² is tested
_TAIL = 1e-4  # probability of either tail of that test


class Cusum(BuiltIn):
    """Page's test on misses of what two others hit, and a χ² test on the d² of the last hits.

    The sum of the d² of an agent's last 30 hits on confirmed tracks has a χ² distribution with 60 degrees of
    freedom as long as it is honest and the tracker's model holds; outside the tails of 1e-4 there is an alarm, also
    where hits are too good. At its looks at tracks that at least two other agents without such an alarm hit,
    g ← max(0, g + ln(q/P_D)) at a hit, else max(0, g + ln((1-q)/(1-P_D))), with q = P_D/2. An agent's trust is
    1 - min(1, g/2h), and 0 while there is an alarm. A track's trust is a moving average, over `window` frames with
    at least two lookers, of the share of hits, weighted by trust.

    h: nats, above 0: about e^h looks of an honest agent pass before a false alarm (g > h, trust below ½); window:
    frames, from 1 to 1000. Raises ValueError outside these ranges. Page, "Continuous inspection schemes",
    Biometrika 41, 1954.
    """

    needs: ClassVar = ("innovations",)
    parameters: ClassVar = {
        "h": "f8 | nats",
        "window": "i8 | frames",
        "low": "f8 | limit of the sum of d²",
        "high": "f8 | the other",
    }
    memory: ClassVar = {
        **VOTES,
        "g": "f8 K | nats",
        "distances": f"f8 K {_HITS} | d² of the last hits",
        "hits": "i8 K | of the agent, so far",
        "improbable": "b1 K | the sum of its last d² lies in a tail",
    }

    def __init__(self, h: float = 7.0, window: int = 10):
        self.h = number("cusum", "h", h, 0.0, ends="(]")
        self.window = whole("cusum", "window", window, 1, 1000)

    def params(self) -> dict[str, Any]:
        return {"h": self.h, "window": self.window}

    def values(self, n_agents: int) -> dict[str, Any]:
        from scipy.special import chdtri  # takes a tenth of a second to import

        low, high = chdtri(2 * _HITS, 1.0 - _TAIL), chdtri(2 * _HITS, _TAIL)
        return self.params() | {"low": float(low), "high": float(high)}

    @staticmethod
    @kernel
    def reset(world):
        """No suspicion."""
        reset_votes(world.cusum, 1.0)
        for k in range(world.cusum.g.shape[0]):
            world.cusum.g[k], world.cusum.hits[k] = 0.0, 0

    @staticmethod
    @kernel
    def judge(world):
        """Agents by their tests, then tracks by the agents."""
        memory, listed = world.cusum, list_confirmed(world)
        for k in range(memory.g.shape[0]):
            for c in range(listed):
                _keep_distance(world, k, world.scratch.listing[c])
            memory.improbable[k] = _is_improbable(world, k)
        for k in range(memory.g.shape[0]):
            for c in range(listed):
                _test_misses(world, k, world.scratch.listing[c])
            memory.weight[k] = 0.0 if memory.improbable[k] else 1.0 - min(1.0, memory.g[k] / (2.0 * memory.h))
            world.verdict.agent_trust[k] = memory.weight[k]
        judge_by_votes(world, memory, listed, memory.window)


@kernel
def _test_misses(world, k, j):
    """g, after a look at a track that two others hit, whose own hits are not improbable."""
    evidence, others = world.evidence, 0
    for other in range(world.cusum.g.shape[0]):
        others += other != k and evidence.hit[other, j] and not world.cusum.improbable[other]
    if others >= 2 and looks_at(world, k, j):
        p = world.agents.believed_p_detect[k]
        q = 0.5 * p
        step = math.log(q / p) if evidence.hit[k, j] else math.log((1.0 - q) / (1.0 - p))
        world.cusum.g[k] = max(0.0, world.cusum.g[k] + step)


@kernel
def _keep_distance(world, k, j):
    """d² of a hit, in the place of the oldest."""
    distance2 = world.evidence.distance2[k, j]
    if not np.isnan(distance2):
        world.cusum.distances[k, world.cusum.hits[k] % _HITS] = distance2
        world.cusum.hits[k] += 1


@kernel
def _is_improbable(world, k):
    """Whether the sum of the last d² lies in a tail of its distribution."""
    if world.cusum.hits[k] < _HITS:
        return False
    total = 0.0
    for i in range(_HITS):
        total += world.cusum.distances[k, i]
    return total < world.cusum.low or total > world.cusum.high
