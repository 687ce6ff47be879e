"""The posterior over sets of adversaries and behaviours, with every track summed out in closed form."""

from __future__ import annotations

import math

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.defenses.joint.areas import spread_shares
from trust_env.defenses.joint.hypotheses import NOBODY
from trust_env.defenses.joint.motions import learn_motion, weigh_modes
from trust_env.defenses.joint.patterns import class_of, has_several, weigh_sets


@kernel
def weigh_cases(world, c, a):
    """Fill `likelihood[A, Y]`, (1-φ) L1 + φ L0 σ, of the track in place c under set a; returns the greatest."""
    joint, top = world.joint_posterior, 0.0
    watched = class_of(joint.members[a], joint.watchers[c])
    shares, likelihood, mark = joint.share_now[a], joint.likelihood[a], joint.mark[c, a]
    real_likelihood, false_likelihood, modes = joint.real_likelihood[a], joint.false_likelihood[a], joint.modes
    y, last = joint.first[watched], 1 if watched == NOBODY else modes.shape[0]
    for p in range(joint.shares[watched]):
        for s in range(real_likelihood.shape[0]):
            real = (1.0 - shares[p]) * real_likelihood[s]
            for m in range(last):
                likelihood[y] = real + shares[p] * false_likelihood * mark[modes[m]]
                top = max(top, likelihood[y])
                y += 1
    return top


@kernel
def weigh_track(world, c, j):
    """Fill `likelihood[A, Y]` of the track in place c, and let the urns take its motion; returns the greatest."""
    joint, top = world.joint_posterior, 0.0
    weigh_sets(world, c)
    spread_shares(world, c)
    for a in range(joint.members.shape[0]):
        weigh_modes(world, c, j, a)
        top = max(top, weigh_cases(world, c, a))
        if has_several(joint.hitters[c] & ~joint.members[a]):
            learn_motion(world, j, a)
    return top


@kernel
def multiply_track(world, c, top):
    """Multiply the likelihoods of the track in place c into `product`; none outweighs e^cap."""
    joint, least, scale = world.joint_posterior, math.exp(-world.joint_posterior.cap_track), 1.0 / top
    for a in range(joint.members.shape[0]):
        watched = class_of(joint.members[a], joint.watchers[c])
        product, likelihood = joint.product[a], joint.likelihood[a]
        for y in range(joint.first[watched], joint.first[watched + 1]):
            product[y] *= likelihood[y] * scale + least


@kernel
def take_logarithms(world):
    """Move the products into the sums of logarithms."""
    joint = world.joint_posterior
    for a in range(joint.product.shape[0]):
        for y in range(joint.product.shape[1]):
            if joint.product[a, y] != 1.0:
                joint.log_product[a, y] += math.log(joint.product[a, y])
                joint.product[a, y] = 1.0


@kernel
def remember_track(world, c, top):
    """A track is gone; what it said stays, each at least -cap_dead."""
    joint, least = world.joint_posterior, math.exp(-world.joint_posterior.cap_track)
    for a in range(joint.members.shape[0]):
        watched = class_of(joint.members[a], joint.watchers[c])
        for y in range(joint.first[watched], joint.first[watched + 1]):
            joint.past[a, y] += max(-joint.cap_dead, math.log(joint.likelihood[a, y] / top + least))


@kernel
def weigh_hypotheses(world):
    """w(A), and under every set the weights of the cases, which sum to one in each class."""
    joint, top, total = world.joint_posterior, -np.inf, 0.0
    for a in range(joint.members.shape[0]):
        joint.weight[a] = joint.set_prior[a] + _take_exponentials(world, a) + _weigh_behaviours(world, a)
        top = max(top, joint.weight[a])
    for a in range(joint.members.shape[0]):
        joint.weight[a] = math.exp(joint.weight[a] - top)
        total += joint.weight[a]
    for a in range(joint.members.shape[0]):
        joint.weight[a] /= total


@kernel
def _take_exponentials(world, a):
    """Turn `product` into the likelihoods of all cases of a set, up to a factor by class; returns its logarithm."""
    joint, tops = world.joint_posterior, 0.0
    product, logs, past = joint.product[a], joint.log_product[a], joint.past[a]
    for watched in range(3):
        first, last, top = joint.first[watched], joint.first[watched + 1], -np.inf
        for y in range(first, last):
            logs[y] += past[y]
            top = max(top, logs[y])
        for y in range(first, last):
            product[y] *= math.exp(logs[y] - top)
        tops += top
    return tops


@kernel
def _weigh_behaviours(world, a):
    """ln Σ_g p(g) of the likelihoods under a set; leaves the weights of the behaviours in those of their cases."""
    joint, total = world.joint_posterior, 0.0
    product, weights, ratios = joint.product[a], joint.case_weight[a], joint.count_ratio[a]
    case, alone, prior = joint.case, joint.alone, joint.prior
    for y in range(weights.shape[0]):
        weights[y] = 0.0
    for b in range(prior.shape[0]):
        weight = prior[b] * ratios[alone[b]] * product[case[b, 0]] * product[case[b, 1]] * product[case[b, 2]]
        for watched in range(3):
            weights[case[b, watched]] += weight
        total += weight
    for y in range(weights.shape[0]):
        weights[y] /= total
    return math.log(total)


@kernel
def probability_of_real(world, c):
    """Σ_A w(A) P(real | A) of the track in place c; P(real | A) is added to `others_now[A]` where others watch."""
    joint, trust = world.joint_posterior, 0.0
    weigh_sets(world, c)
    spread_shares(world, c)
    for a in range(joint.members.shape[0]):
        real = _real_under(world, c, a)
        trust += joint.weight[a] * real
        if joint.watchers[c] & ~joint.members[a] != 0:
            joint.others_now[a] += real
    return trust


@kernel
def _real_under(world, c, a):
    """P(real | A) of the track in place c: Σ over the cases of their weight times (1-φ) L1/((1-φ) L1 + φ L0 σ)."""
    joint, total = world.joint_posterior, 0.0
    watched = class_of(joint.members[a], joint.watchers[c])
    shares, weights, mark = joint.share_now[a], joint.case_weight[a], joint.mark[c, a]
    real_likelihood, false_likelihood, modes = joint.real_likelihood[a], joint.false_likelihood[a], joint.modes
    y, last = joint.first[watched], 1 if watched == NOBODY else modes.shape[0]
    for p in range(joint.shares[watched]):
        for s in range(real_likelihood.shape[0]):
            real = (1.0 - shares[p]) * real_likelihood[s]
            for m in range(last):
                total += weights[y] * real / (real + shares[p] * false_likelihood * mark[modes[m]])
                y += 1
    return total
