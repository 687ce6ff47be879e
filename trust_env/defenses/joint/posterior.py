"""The posterior over sets of adversaries and behaviours, with every track summed out in closed form."""

from __future__ import annotations

import math

import numpy as np

from trust_env.compiled.kernels import inlined, kernel
from trust_env.defenses.joint.areas import spread_shares
from trust_env.defenses.joint.motions import learn_motion, weigh_modes
from trust_env.defenses.joint.patterns import class_of, has_several, weigh_sets


@inlined
def share_of(world, a, y):
    """φ of the track in hand under set a, in case y."""
    joint = world.joint_posterior
    return joint.share[y] if joint.place[y] < 0 else joint.alone_now[a, joint.place[y]]


@inlined
def track_likelihood(world, c, a, y):
    """(1-φ) L1 + φ L0 σ of the track in place c under set a, in case y."""
    joint, share = world.joint_posterior, share_of(world, a, y)
    real = (1.0 - share) * joint.real_likelihood[a, joint.withheld[y]]
    return real + share * joint.false_likelihood[a] * joint.mark[c, a, joint.mode[y]]


@kernel
def weigh_track(world, c, j):
    """Fill `likelihood[A, Y]` of the track in place c, and let the urns take its motion; returns the greatest."""
    joint, top = world.joint_posterior, 0.0
    weigh_sets(world, c)
    spread_shares(world, c)
    for a in range(joint.members.shape[0]):
        weigh_modes(world, c, j, a)
        watched = class_of(joint.members[a], joint.watchers[c])
        for y in range(joint.first[watched], joint.first[watched + 1]):
            joint.likelihood[a, y] = track_likelihood(world, c, a, y)
            top = max(top, joint.likelihood[a, y])
        if has_several(joint.hitters[c] & ~joint.members[a]):
            learn_motion(world, j, a)
    return top


@kernel
def multiply_track(world, c, top):
    """Multiply the likelihoods of the track in place c into `product`; none outweighs e^cap."""
    joint, least = world.joint_posterior, math.exp(-world.joint_posterior.cap_track)
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
    """ln Σ_g w(A, g)/p(A); adds the weights of the behaviours to those of their cases."""
    joint, behaviour, top, total = world.joint_posterior, world.joint_posterior.behaviour, -np.inf, 0.0
    for b in range(behaviour.shape[0]):
        behaviour[b] = joint.prior[b] + joint.count_gain[a, joint.alone[b]]
        for watched in range(3):
            behaviour[b] += joint.log_product[a, joint.case[b, watched]]
        top = max(top, behaviour[b])
    for b in range(behaviour.shape[0]):
        behaviour[b] = math.exp(behaviour[b] - top)
        total += behaviour[b]
    for b in range(behaviour.shape[0]):
        for watched in range(3):
            joint.case_weight[a, joint.case[b, watched]] += behaviour[b] / total
    return top + math.log(total)


@kernel
def probability_of_real(world, c):
    """Σ_A w(A) P(real | A) of the track in place c; P(real | A) is added to `others_now[A]` where others watch."""
    joint, trust = world.joint_posterior, 0.0
    weigh_sets(world, c)
    spread_shares(world, c)
    for a in range(joint.members.shape[0]):
        watched, real = class_of(joint.members[a], joint.watchers[c]), 0.0
        for y in range(joint.first[watched], joint.first[watched + 1]):
            likelihood = (1.0 - share_of(world, a, y)) * joint.real_likelihood[a, joint.withheld[y]]
            real += joint.case_weight[a, y] * likelihood / track_likelihood(world, c, a, y)
        trust += joint.weight[a] * real
        if joint.watchers[c] & ~joint.members[a] != 0:
            joint.others_now[a] += real
    return trust
