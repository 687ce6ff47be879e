"""Likelihoods of who hit and who missed a track, for every set of adversaries, if it is real and if it is not.

With h hits in n looks, P = P_D^h (1 - P_D)^(n-h), S = ε^h (1 - ε)^(n-h), O = B(h+1, n-h+1):

    benign, real       b1 = (1-κ) P + κ O                      benign, false      b0 = (1-κ) S + κ O
    adversary, real    a1 = (1-κ) [(1-s) P + s S] + κ O        adversary, false   a0 = (1-κ) [r P + (1-r) S] + κ O
"""

from __future__ import annotations

import math

from trust_env.compiled.kernels import inlined, kernel
from trust_env.defenses.joint.hypotheses import ALONE, NOBODY, TOGETHER

WATCHES = 0.3  # share of the most looks that an agent has at a track from which on another one watches it
CERTAIN_HITS = 3.0  # an agent with more has certainly hit a track


@kernel
def weigh_patterns(world, c, j):
    """Patterns of column j in place c of the list: by agent the ratios of adversary to benign, and the products
    over all agents when all are benign.
    """
    joint, real, false = world.joint_posterior, 1.0, 1.0
    for k in range(joint.hits.shape[0]):
        expected, stray, other = _patterns(world, k, j)
        benign_real, benign_false = max(expected + other, joint.least), max(stray + other, joint.least)
        real, false = real * benign_real, false * benign_false
        adversary_false = joint.r * expected + (1.0 - joint.r) * stray + other
        joint.false_ratio[c, k] = max(adversary_false, joint.least) / benign_false
        for s in range(joint.levels.shape[0]):
            adversary_real = (1.0 - joint.levels[s]) * expected + joint.levels[s] * stray + other
            joint.real_ratio[c, k, s] = max(adversary_real, joint.least) / benign_real
    joint.real[c], joint.false[c] = real, false


@kernel
def _patterns(world, k, j):
    """(1-κ) P, (1-κ) S and κ O of agent k at track j, in units of the greatest of P, S and O."""
    joint, hits, looks = world.joint_posterior, world.joint_posterior.hits[k, j], world.joint_posterior.looks[k, j]
    if looks == 0.0:
        return 1.0 - joint.kappa, 1.0 - joint.kappa, joint.kappa
    misses = max(0.0, looks - hits)
    expected = joint.seen[k, j]
    stray = hits * joint.ln_eps + misses * joint.ln_not_eps
    other = math.lgamma(hits + 1.0) + math.lgamma(misses + 1.0) - math.lgamma(looks + 2.0)
    top, rest = max(expected, stray, other), 1.0 - joint.kappa
    return rest * math.exp(expected - top), rest * math.exp(stray - top), joint.kappa * math.exp(other - top)


@kernel
def note_watchers(world, c, j):
    """Who watches column j, and who has certainly hit it, as bits by agent."""
    joint, most = world.joint_posterior, 0.0
    for k in range(joint.hits.shape[0]):
        most = max(most, joint.looks[k, j])
    watchers, hitters = 0, 0
    for k in range(joint.hits.shape[0]):
        if joint.looks[k, j] > WATCHES * most:
            watchers |= 1 << k
            if joint.hits[k, j] > CERTAIN_HITS:
                hitters |= 1 << k
    joint.watchers[c], joint.hitters[c] = watchers, hitters


@inlined
def has_several(bits):
    """Whether at least two bits are set."""
    return bits & (bits - 1) != 0


@inlined
def class_of(members, watchers):
    """Who of a set watches a track: nobody, some together with others, or only they."""
    if members & watchers == 0:
        return NOBODY
    return ALONE if watchers & ~members == 0 else TOGETHER


@kernel
def weigh_sets(world, c):
    """L1[A, s] and L0[A]: likelihoods of the track in place c, real and false, under every set."""
    joint = world.joint_posterior
    real, false, lowest, parent = joint.real_likelihood, joint.false_likelihood, joint.lowest, joint.parent
    real_ratio, false_ratio = joint.real_ratio[c], joint.false_ratio[c]
    false[0] = joint.false[c]
    for s in range(real.shape[1]):
        real[0, s] = joint.real[c]
    for a in range(1, parent.shape[0]):
        k, before = lowest[a], parent[a]
        false[a] = false[before] * false_ratio[k]
        for s in range(real.shape[1]):
            real[a, s] = real[before, s] * real_ratio[k, s]
