"""`parsimony`: the least set of liars that explains all contradictions."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.defenses.base import BuiltIn
from trust_env.defenses.binomial import binomial_cdf, rounded
from trust_env.defenses.checks import number
from trust_env.defenses.looks import LOOKS, believe, count_looks, forget_all

MOST_AGENTS = 12  # of all their sets each is tried
_SAME = 1e-9  # nats between weights that are taken as equal
_FOR, _AGAINST = range(2)


class Parsimony(BuiltIn):
    """The least sets of liars that explain who contradicts whom, by vertex covers (after Golle et al. 2004).

    An agent that looks at a track claims that it is there if P[Bin(n, ε) ≥ h] < a, and denies it if
    P[Bin(n, P_D) ≤ h] < a, for n looks and h hits, which forget by γ at each look and are rounded. Agents of
    whom one claims what the other denies are in conflict, so one of them lies. Explanations are the sets of
    liars that leave no conflict and have the least weight Σ ln((1-π)/π). An agent's trust is the share of
    explanations without it. A track's trust is the mean over the explanations: 1 if an agent that does not lie
    claims it, 0 if one denies it, ½ if only liars speak; no opinion where nobody does.

    a, epsilon: in (0, 1); gamma: in (0, 1]; pi: in (0, 0.5), the prior probability of a liar, where the scenario
    does not give an agent's own (`belief.compromised`). Raises ValueError outside these ranges, and for more
    than 12 agents. After Golle, Greene & Staddon, "Detecting and correcting malicious data in VANETs", 2004.
    """

    parameters: ClassVar = {"a": "f8", "epsilon": "f8", "gamma": "f8", "pi": "f8"}
    memory: ClassVar = {
        **LOOKS,
        "speakers": "i8 J 2 | bit k: agent k claims the track; denies it",
        "conflicts": "i8 K | bit l: agent l contradicts",
    }
    scratch: ClassVar = {
        "cost": "f8 K | nats, of taking the agent for a liar",
        "cleared": "f8 K | explanations without the agent",
        "score": "f8 J | sum over the explanations",
    }

    def __init__(self, a: float = 1e-3, epsilon: float = 0.02, gamma: float = 0.95, pi: float = 0.25):
        self._params = {
            "a": number("parsimony", "a", a, 0.0, 1.0, "()"),
            "epsilon": number("parsimony", "epsilon", epsilon, 0.0, 1.0, "()"),
            "gamma": number("parsimony", "gamma", gamma, 0.0, 1.0, "(]"),
            "pi": number("parsimony", "pi", pi, 0.0, 0.5, "()"),
        }

    def params(self) -> dict[str, Any]:
        return dict(self._params)

    def values(self, n_agents: int) -> dict[str, Any]:
        if n_agents > MOST_AGENTS:
            raise ValueError(f"parsimony tries all sets of agents: expected at most {MOST_AGENTS}, not K = {n_agents}")
        return self._params

    @staticmethod
    @kernel
    def reset(world):
        """Nothing counted."""
        forget_all(world.parsimony)

    @staticmethod
    @kernel
    def judge(world):
        """Claims, conflicts, explanations, verdict."""
        listed = count_looks(world, world.parsimony, world.parsimony.gamma)
        for c in range(listed):
            _hear(world, world.scratch.listing[c])
        _find_conflicts(world, listed)
        explanations = _explain(world, listed)
        for k in range(world.parsimony.cleared.shape[0]):
            world.verdict.agent_trust[k] = world.parsimony.cleared[k] / explanations
        for c in range(listed):
            j = world.scratch.listing[c]
            spoken = world.parsimony.speakers[j, _FOR] | world.parsimony.speakers[j, _AGAINST]
            believe(world, j, world.parsimony.score[j] / explanations if spoken != 0 else np.nan)


@kernel
def _hear(world, j):
    """Who claims a track, who denies it."""
    memory, agents = world.parsimony, world.agents
    memory.speakers[j, _FOR], memory.speakers[j, _AGAINST], memory.score[j] = 0, 0, 0.0
    for k in range(memory.cost.shape[0]):
        n, h = rounded(memory.looks[k, j]), rounded(memory.hits[k, j])
        if n == 0:
            continue
        if binomial_cdf(n - h, n, 1.0 - memory.epsilon) < memory.a:  # P[Bin(n, ε) ≥ h]
            memory.speakers[j, _FOR] |= 1 << k
        elif binomial_cdf(h, n, agents.believed_p_detect[k]) < memory.a:
            memory.speakers[j, _AGAINST] |= 1 << k


@kernel
def _find_conflicts(world, listed):
    """Who contradicts whom, and what it costs to take an agent for a liar."""
    memory, prior = world.parsimony, world.agents.prior_compromised
    for k in range(memory.cost.shape[0]):
        pi = memory.pi if np.isnan(prior[k]) else min(max(prior[k], 1e-12), 1.0 - 1e-12)
        memory.cost[k], memory.conflicts[k], memory.cleared[k] = math.log((1.0 - pi) / pi), 0, 0.0
        for c in range(listed):
            j = world.scratch.listing[c]
            for side in range(2):
                if (memory.speakers[j, side] >> k) & 1:
                    memory.conflicts[k] |= memory.speakers[j, 1 - side]


@kernel
def _explain(world, listed):
    """Find the least weight of a set that leaves no conflict, then count what all sets of that weight say;
    returns how many there are.
    """
    agents, least, explanations = world.parsimony.cost.shape[0], np.inf, 0
    for liars in range(1 << agents):
        if _leaves_no_conflict(world, liars):
            least = min(least, _weight(world, liars))
    for liars in range(1 << agents):
        if _weight(world, liars) <= least + _SAME and _leaves_no_conflict(world, liars):
            explanations += 1
            _count(world, liars, listed)
    return explanations


@kernel
def _leaves_no_conflict(world, liars):
    """Whether of any two agents in conflict one is in the set."""
    for k in range(world.parsimony.cost.shape[0]):
        if not (liars >> k) & 1 and (world.parsimony.conflicts[k] & ~liars) != 0:
            return False
    return True


@kernel
def _weight(world, liars):
    """Σ ln((1-π)/π) over a set."""
    total = 0.0
    for k in range(world.parsimony.cost.shape[0]):
        if (liars >> k) & 1:
            total += world.parsimony.cost[k]
    return total


@kernel
def _count(world, liars, listed):
    """What an explanation says of agents and tracks."""
    memory = world.parsimony
    for k in range(memory.cost.shape[0]):
        memory.cleared[k] += 1.0 - ((liars >> k) & 1)
    for c in range(listed):
        j = world.scratch.listing[c]
        if memory.speakers[j, _FOR] & ~liars:
            memory.score[j] += 1.0
        elif not memory.speakers[j, _AGAINST] & ~liars:
            memory.score[j] += 0.5
