"""What `joint_posterior` sums over: sets of adversaries, and how a coalition behaves, as tables for kernels."""

from __future__ import annotations

import math
from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from trust_env.compiled.kernels import kernel

MOST_EXACT = 10  # agents up to which all sets are hypotheses
MOST_SETS = 2**13
MOST_AGENTS = 62  # bits of a set
NOBODY, TOGETHER, ALONE = range(3)  # who of a set watches a track: none, some and others too, only they
PLAIN, STANDING, EXACT = range(3)  # modes of a coalition: its false tracks are like targets, stand still, fit too well


class Sets(NamedTuple):
    """Sets of adversaries, each after the one that it adds an agent to; the empty set is the first.

    members: int64[A], bit k: agent k; parent: int64[A], the set without its lowest agent; lowest: int64[A].
    """

    members: np.ndarray
    parent: np.ndarray
    lowest: np.ndarray


class Behaviours(NamedTuple):
    """Behaviours g = (φ_alone, φ_together, s, mode) as tables.

    A track's likelihood depends on who watches it, and only on a part of g: on s where nobody of the set watches,
    on (φ_together, s, mode) where some and others do, on (φ_alone, s, mode) where only they do. These are the
    *cases*, in this order; those of class c are `first[c]` to `first[c + 1] - 1`.

    first: int64[4]; case: int64[B, 3], a behaviour's case by class; alone: int64[B], the place of its φ_alone;
    prior: float64[B], p(g).
    """

    first: np.ndarray
    case: np.ndarray
    alone: np.ndarray
    prior: np.ndarray


def all_sets(n_agents: int, most: int) -> bool:
    """Whether every set of agents is a hypothesis."""
    return n_agents <= max(MOST_EXACT, most)


def count_sets(n_agents: int, most: int) -> int:
    """A, the number of sets of adversaries that are hypotheses."""
    size = n_agents if all_sets(n_agents, most) else most
    return sum(math.comb(n_agents, n) for n in range(size + 1))


def adversary_sets(n_agents: int, most: int) -> Sets:
    """All sets of agents; of more than ten agents only those of at most `most`."""
    size = n_agents if all_sets(n_agents, most) else most
    chosen = [agents for n in range(size + 1) for agents in combinations(range(n_agents), n)]
    members = [sum(1 << k for k in agents) for agents in chosen]
    place = {mask: a for a, mask in enumerate(members)}
    parent = [place[mask & (mask - 1)] for mask in members]
    lowest = [min(agents, default=0) for agents in chosen]
    return Sets(*(np.array(column, dtype=np.int64) for column in (members, parent, lowest)))


def behaviours(alone: int, together: int, levels: int, modes: int, dormant: float) -> Behaviours:
    """The tables of all combinations of so many φ_alone, φ_together, s and modes, each from the least to the
    greatest; the behaviours that do least, in any mode, have the prior probability `dormant`, the others share the
    rest.
    """
    first = np.cumsum([0, levels, together * levels * modes, alone * levels * modes])
    places = np.array(list(product(range(alone), range(together), range(levels), range(modes))))
    x, i, s, m = places.T
    case = np.stack([s, first[1] + (i * levels + s) * modes + m, first[2] + (x * levels + s) * modes + m], axis=1)
    idle = (x == 0) & (i == 0) & (s == 0)
    weights = np.where(idle, dormant / idle.sum(), (1.0 - dormant) / max(1, (~idle).sum()))
    return Behaviours(first, case, x, weights / weights.sum())


@kernel
def weigh_priors(world):
    """ln p(A): agents are compromised on their own or, where they share a platform type, perhaps all together.

    p(A) = Π over types [(1-q) Π p_k + q Π P_k], p_k from the agents' own priors and P_k from `platform_share`,
    times Π p_k of the agents without a type; p_k is the prior of what A says of agent k.
    """
    joint = world.joint_posterior
    for a in range(joint.members.shape[0]):
        total = 0.0
        for k in range(joint.hits.shape[0]):
            if _leads_platform(world, k):
                total += math.log(_platform_prior(world, joint.members[a], k))
        joint.set_prior[a] = total


@kernel
def _leads_platform(world, k):
    """Whether no agent before k has its platform type."""
    platform, before = world.agents.platform, 0
    for other in range(k):
        before += platform[k] >= 0 and platform[other] == platform[k]
    return before == 0


@kernel
def _platform_prior(world, members, first):
    """The prior of what a set says of all agents with the platform type of the first; of agent `first` if none."""
    joint, agents, own, together = world.joint_posterior, world.agents, 1.0, 1.0
    for k in range(first, agents.platform.shape[0]):
        if k == first or (agents.platform[first] >= 0 and agents.platform[k] == agents.platform[first]):
            given = agents.prior_compromised[k]
            prior = joint.pi if np.isnan(given) else given
            compromised = (members >> k) & 1 == 1
            own *= prior if compromised else 1.0 - prior
            together *= joint.platform_share if compromised else 1.0 - joint.platform_share
    if agents.platform[first] < 0:
        return own
    return (1.0 - joint.platform_prior) * own + joint.platform_prior * together
