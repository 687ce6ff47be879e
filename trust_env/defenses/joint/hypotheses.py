"""What `joint_posterior` sums over: sets of adversaries, and how a coalition behaves, as tables for kernels."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product
from typing import NamedTuple

import numpy as np

MOST_EXACT = 10  # agents up to which all sets are hypotheses
MOST_SETS = 8192
PLAIN, STANDING, EXACT = range(3)  # how a coalition's false tracks differ from targets: modes
NOBODY, TOGETHER, ALONE = range(3)  # of a set, who watches a track: none of it, it and others, it alone


class Sets(NamedTuple):
    """Sets of adversaries, each after the one that it adds an agent to; the empty set is the first.

    members: int64[A], bit k: agent k; parent: int64[A], the set without its lowest agent; lowest: int64[A].
    """

    members: np.ndarray
    parent: np.ndarray
    lowest: np.ndarray


class Behaviours(NamedTuple):
    """Behaviours (φ_alone, φ_together, s, mode) as tables.

    A track's likelihood depends on who watches it, and on a few numbers of the behaviour only: on s where
    nobody of the set watches, on (φ_together, s, mode) and on (φ_alone, s, mode) elsewhere. These are the Y
    *cases*; `first[c]` to `first[c + 1]` are those of class c.

    share: float64[Y], φ; withheld: int64[Y], place of s in `levels`; mode: int64[Y]; levels: float64[S];
    case: int64[B, 3], a behaviour's case by class; alone: int64[B], the place of its φ_alone; prior: float64[B],
    ln p(g).
    """

    share: np.ndarray
    withheld: np.ndarray
    mode: np.ndarray
    levels: np.ndarray
    first: np.ndarray
    case: np.ndarray
    alone: np.ndarray
    prior: np.ndarray


def are_all(n_agents: int, most: int) -> bool:
    """Whether every set of agents is a hypothesis."""
    return n_agents <= max(MOST_EXACT, most)


def count_sets(n_agents: int, most: int) -> int:
    """A, the number of hypotheses about who is an adversary."""
    if are_all(n_agents, most):
        return 2**n_agents
    total, choices = 0, 1
    for size in range(most + 1):
        total += choices
        choices = choices * (n_agents - size) // (size + 1)
    return total


def adversary_sets(n_agents: int, most: int) -> Sets:
    """All sets of agents; of more than ten agents only those of at most `most`."""
    size = n_agents if are_all(n_agents, most) else most
    chosen = [agents for n in range(size + 1) for agents in combinations(range(n_agents), n)]
    members = [sum(1 << k for k in agents) for agents in chosen]
    place = {mask: a for a, mask in enumerate(members)}
    parent = [place[mask & (mask - 1)] for mask in members]
    lowest = [min(agents, default=0) for agents in chosen]
    return Sets(*(np.array(column, dtype=np.int64) for column in (members, parent, lowest)))


def behaviours(
    natural: float,
    together: Sequence[float],
    alone: Sequence[float],
    levels: Sequence[float],
    modes: Sequence[int],
    dormant: float,
) -> Behaviours:
    """The tables of the behaviours; of the given modes."""
    withheld = range(len(levels))
    cases = [(natural, s, PLAIN) for s in withheld]
    first = [0, len(cases)]
    for shares in (together, alone):
        cases += product(shares, withheld, modes)
        first.append(len(cases))
    combined = list(product(range(len(alone)), range(len(together)), withheld, range(len(modes))))
    case, idle = [], []
    for x, i, s, m in combined:
        of_pair = [(place * len(levels) + s) * len(modes) + m for place in (i, x)]
        case.append((s, first[1] + of_pair[0], first[2] + of_pair[1]))
        idle.append(x == i == s == 0)
    weights = np.where(idle, dormant / sum(idle), (1.0 - dormant) / max(1, len(idle) - sum(idle)))
    share, place, mode = (np.array(column) for column in zip(*cases, strict=True))
    with np.errstate(divide="ignore"):
        prior = np.log(weights)
    places = [x for x, _, _, _ in combined]
    return Behaviours(share, place, mode, np.array(levels), np.array(first), np.array(case), np.array(places), prior)
