"""What defenses count: looks of agents at tracks, and how a track is judged by votes that differ in weight.

F is `expected`, H is `hit`: a detection was assigned to the track. A look is F or H, so that a hit outside the FOV
counts; a look without a hit is a miss, also of an agent whose reports the centre ignores. Kernels here take a
defense's group as `memory`, with the fields of LOOKS or of VOTES in it.
"""

from __future__ import annotations

import numpy as np

from trust_env.compiled.kernels import inlined, kernel
from trust_env.defenses.base import ACCEPT
from trust_env.defenses.beta_belief import mean_of, variance_of
from trust_env.world.tracking.track_store import list_confirmed

LOOKS = {
    "track_id": "i8 J | whose counts these are; -1: nobody's",
    "looks": "f8 K J | n ← γn + 1 at a look",
    "hits": "f8 K J | h ← γh + H at a look",
}
VOTES = {
    "track_id": "i8 J | whose average this is; -1: nobody's",
    "share": "f8 J | moving average of the share of hits; NaN: none yet",
    "weight": "f8 K | of an agent's vote",
    "agreement": "f8 K 2 | how often the agent agreed, and did not, in this frame",
}
TIE = 1e-9  # votes for and against that differ by less of them are a tie


@inlined
def looks_at(world, k, j):
    """Whether agent k is expected to see track j, or hits it."""
    return world.evidence.expected[k, j] or world.evidence.hit[k, j]


@kernel
def forget_all(memory):
    """No column belongs to a track."""
    for j in range(memory.track_id.shape[0]):
        memory.track_id[j] = -1


@kernel
def count_looks(world, memory, gamma):
    """n ← γn + 1 and h ← γh + H at every look at a confirmed track; returns how many tracks are in
    `scratch.listing`.
    """
    listed = list_confirmed(world)
    for c in range(listed):
        j = world.scratch.listing[c]
        is_new = memory.track_id[j] != world.tracks.id[j]
        memory.track_id[j] = world.tracks.id[j]
        for k in range(memory.looks.shape[0]):
            if is_new:
                memory.looks[k, j], memory.hits[k, j] = 0.0, 0.0
            if looks_at(world, k, j):
                memory.looks[k, j] = gamma * memory.looks[k, j] + 1.0
                memory.hits[k, j] = gamma * memory.hits[k, j] + world.evidence.hit[k, j]
    return listed


@kernel
def reset_votes(memory, weight):
    """All agents have the same weight, no track has an average."""
    forget_all(memory)
    for k in range(memory.weight.shape[0]):
        memory.weight[k] = weight


@kernel
def count_agreements(world, memory, listed):
    """How often each agent agrees with the weighted vote of the others that look at the same track. Ties, and
    looks of one agent alone, say nothing.
    """
    weight, agreement = memory.weight, memory.agreement
    for k in range(weight.shape[0]):
        agreement[k, 0], agreement[k, 1] = 0.0, 0.0
    for c in range(listed):
        j = world.scratch.listing[c]
        _, total, hits = vote(world, j, weight)
        for k in range(weight.shape[0]):
            if looks_at(world, k, j):
                hit = world.evidence.hit[k, j]
                others, yes = total - weight[k], hits - weight[k] * hit
                lean = 2.0 * yes - others
                if abs(lean) > TIE * total:
                    agreement[k, 0 if hit == (lean > 0.0) else 1] += 1.0


@kernel
def vote(world, j, weight):
    """How many agents look at a track, the sum of their weights, and that of those who hit it."""
    looks, total, hits = 0, 0.0, 0.0
    for k in range(weight.shape[0]):
        if looks_at(world, k, j):
            looks += 1
            total += weight[k]
            hits += weight[k] * world.evidence.hit[k, j]
    return looks, total, hits


@kernel
def judge_by_votes(world, memory, listed, window):
    """A track's trust is a moving average, over about `window` frames, of the weighted share of hits among those
    that look at it. Only frames in which two agents do so count; before the first there is no opinion.
    """
    for c in range(listed):
        j = world.scratch.listing[c]
        if memory.track_id[j] != world.tracks.id[j]:
            memory.track_id[j], memory.share[j] = world.tracks.id[j], np.nan
        looks, total, hits = vote(world, j, memory.weight)
        if looks >= 2 and total > 0.0:
            before = memory.share[j]
            memory.share[j] = hits / total if np.isnan(before) else before + (hits / total - before) / window
        believe(world, j, memory.share[j])


@inlined
def believe(world, j, trust):
    """The verdict on a track: its trust (NaN: no opinion), and whether it is shown."""
    world.verdict.track_trust[j] = trust
    world.verdict.publish[j] = not trust < ACCEPT


@inlined
def believe_agent(world, k, alpha, beta):
    """The verdict on an agent: mean and variance of Beta(α, β); returns the mean."""
    belief = (alpha, beta)
    world.verdict.agent_trust[k], world.verdict.agent_trust_var[k] = mean_of(belief), variance_of(belief)
    return world.verdict.agent_trust[k]
