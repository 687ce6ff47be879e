"""The posterior over sets of adversaries and behaviours, with every track summed out in closed form."""

from __future__ import annotations

import math

import numpy as np

from trust_env.compiled.kernels import inlined, kernel
from trust_env.defenses.joint.hypotheses import ALONE, NOBODY
from trust_env.defenses.joint.patterns import class_of, weigh_sets
from trust_env.defenses.joint.velocities import learn_velocity, weigh_modes, velocity_of_real


@inlined
def track_likelihood(world, a, y, mark):
    """(1-φ) L1 + φ L0 σ under set a, in case y."""
    joint = world.joint_posterior
    share = joint.share[y]
    false = share * joint.false_likelihood[a] * mark[joint.mode[y]]
    return (1.0 - share) * joint.real_likelihood[a, joint.withheld[y]] + false


@kernel
def weigh_track(world, c, j):
    """Fill `likelihood[A, Y]` of the track in place c, and teach the urns its velocity; returns the greatest."""
    joint, top = world.joint_posterior, 0.0
    weigh_sets(world, c)
    for a in range(joint.members.shape[0]):
        real = velocity_of_real(world, j, a) if joint.kinematics != 0.0 else 1.0
        weigh_modes(world, c, j, a, real)
        watched = class_of(joint.members[a], joint.watchers[c])
        factor = real if joint.proper != 0.0 else 1.0
        for y in range(joint.first[watched], joint.first[watched + 1]):
            likelihood = factor * track_likelihood(world, a, y, joint.mark[c, a])
            joint.likelihood[a, y] = likelihood
            top = max(top, likelihood)
        hitters = joint.hitters[c] & ~joint.members[a]
        if hitters & (hitters - 1) != 0:
            learn_velocity(world, j, a, joint.urn_weight)
    return top


@kernel
def multiply_track(world, c, top):
    """Multiply the track's likelihoods into `product`; none outweighs e^cap."""
    joint = world.joint_posterior
    least = math.exp(-joint.cap_track)
    for a in range(joint.members.shape[0]):
        watched = class_of(joint.members[a], joint.watchers[c])
        for y in range(joint.first[watched], joint.first[watched + 1]):
            joint.product[a, y] *= joint.likelihood[a, y] / top + least


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
    """A track has died: what it said is remembered, at least -cap_dead."""
    joint = world.joint_posterior
    for a in range(joint.members.shape[0]):
        watched = class_of(joint.members[a], joint.watchers[c])
        for y in range(joint.first[watched], joint.first[watched + 1]):
            ratio = joint.likelihood[a, y] / top + math.exp(-joint.cap_track)
            joint.past[a, y] += max(-joint.cap_dead, math.log(ratio))


@kernel
def weigh_hypotheses(world):
    """w(A) in `weight`, and for every set the weights of the cases, `case_weight[A, Y]`, each class summing to 1."""
    joint, top, total = world.joint_posterior, -np.inf, 0.0
    for a in range(joint.members.shape[0]):
        for y in range(joint.share.shape[0]):
            joint.log_product[a, y] += joint.past[a, y]
            joint.case_weight[a, y] = 0.0
        joint.weight[a] = joint.set_prior[a] + _weigh_behaviours(world, a)
        top = max(top, joint.weight[a])
    for a in range(joint.members.shape[0]):
        joint.weight[a] = math.exp(joint.weight[a] - top)
        total += joint.weight[a]
    for a in range(joint.members.shape[0]):
        joint.weight[a] /= total


@kernel
def _weigh_behaviours(world, a):
    """The logarithm of Σ_g w(A, g) / p(A), and the weights of the cases under A."""
    joint, top, total = world.joint_posterior, -np.inf, 0.0
    for b in range(joint.prior.shape[0]):
        case = joint.case[b]
        joint.behaviour[b] = joint.prior[b] + joint.count_gain[a, joint.alone[b]]
        for watched in range(3):
            joint.behaviour[b] += joint.log_product[a, case[watched]]
        top = max(top, joint.behaviour[b])
    for b in range(joint.prior.shape[0]):
        joint.behaviour[b] = math.exp(joint.behaviour[b] - top)
        total += joint.behaviour[b]
    for b in range(joint.prior.shape[0]):
        for watched in range(3):
            joint.case_weight[a, joint.case[b, watched]] += joint.behaviour[b] / total
    return top + math.log(total)


@kernel
def judge_track(world, c):
    """P(real) of the track in place c; and under every set, added to `others_seen[A]` where others watch it."""
    joint, trust = world.joint_posterior, 0.0
    weigh_sets(world, c)
    for a in range(joint.members.shape[0]):
        watched, real = class_of(joint.members[a], joint.watchers[c]), 0.0
        for y in range(joint.first[watched], joint.first[watched + 1]):
            likelihood = (1.0 - joint.share[y]) * joint.real_likelihood[a, joint.withheld[y]]
            total = track_likelihood(world, a, y, joint.mark[c, a])
            real += joint.case_weight[a, y] * likelihood / total
        trust += joint.weight[a] * real
        if watched != ALONE and joint.watchers[c] & ~joint.members[a] != 0:
            joint.others_seen[a] += real
    return trust
