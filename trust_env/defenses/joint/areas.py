"""How many tracks only a set of agents watches, against what the area that only they cover would hold."""

from __future__ import annotations

import math

import numpy as np

from trust_env.compiled.kernels import inlined, kernel
from trust_env.defenses.joint.hypotheses import ALONE
from trust_env.defenses.joint.patterns import class_of
from trust_env.world.fov import contains

GRID = 40


@kernel
def survey(world):
    """Areas, as shares of what is covered: by the same agents (regions); for every set what it covers alone, and
    what somebody outside it covers. Again when poses have changed.
    """
    joint = world.joint_posterior
    moved = False
    for k in range(joint.pose.shape[0]):
        for i in range(3):
            moved |= joint.pose[k, i] != world.agents.pose[k, i]
            joint.pose[k, i] = world.agents.pose[k, i]
    if moved:
        _list_regions(world)
        for a in range(joint.members.shape[0]):
            joint.alone_area[a], joint.others_area[a] = 0.0, 0.0
            for q in range(joint.regions):
                if joint.region[q] & ~joint.members[a] == 0:
                    joint.alone_area[a] += joint.region_area[q]
                else:
                    joint.others_area[a] += joint.region_area[q]


@kernel
def _list_regions(world):
    joint, box, total = world.joint_posterior, world.agents.fov_box, 0.0
    x0, x1, y0, y1 = np.inf, -np.inf, np.inf, -np.inf
    for k in range(box.shape[0]):
        x0, x1, y0, y1 = min(x0, box[k, 0]), max(x1, box[k, 1]), min(y0, box[k, 2]), max(y1, box[k, 3])
    joint.regions = 0
    for gx in range(GRID):
        for gy in range(GRID):
            watchers = 0
            for k in range(box.shape[0]):
                x, y = x0 + (x1 - x0) * (gx + 0.5) / GRID, y0 + (y1 - y0) * (gy + 0.5) / GRID
                if contains(world, k, x, y):
                    watchers |= 1 << k
            if watchers != 0:
                joint.region_area[region_of(world, watchers)] += 1.0
                total += 1.0
    for q in range(joint.regions):
        joint.region_area[q] /= total


@kernel
def region_of(world, watchers):
    """The place of the region that these agents cover, a new one if there is none and room for it; else -1."""
    joint = world.joint_posterior
    for q in range(joint.regions):
        if joint.region[q] == watchers:
            return q
    if joint.regions == joint.region.shape[0]:
        return -1
    joint.region[joint.regions], joint.region_area[joint.regions] = watchers, 0.0
    joint.regions += 1
    return joint.regions - 1


@kernel
def learn_dispersion(world, listed):
    """How much more the counts of tracks in regions with several watchers vary than a Poisson's."""
    joint = world.joint_posterior
    known, tracks, area = joint.regions, 0.0, 0.0
    for q in range(known):
        joint.region_count[q] = 0.0
    for c in range(listed):
        watchers = joint.watchers[c]
        if watchers & (watchers - 1) != 0:
            tracks += 1.0
            for q in range(known):
                if joint.region[q] == watchers:
                    joint.region_count[q] += 1.0
    for q in range(known):
        if joint.region[q] & (joint.region[q] - 1) != 0:
            area += joint.region_area[q]
    density, square, mean, mean_square = (tracks + 0.5) / (area + 0.05), 0.0, 0.0, 0.0
    for q in range(known):
        if joint.region[q] & (joint.region[q] - 1) != 0 and joint.region_area[q] > 0.01:
            expected = density * joint.region_area[q]
            square += (joint.region_count[q] - expected) ** 2
            mean += expected
            mean_square += expected * expected
    joint.frames += 1.0
    rate = max(0.02, 1.0 / joint.frames)
    joint.dispersion[0] += rate * (square - joint.dispersion[0])
    joint.dispersion[1] += rate * (mean - joint.dispersion[1])
    joint.dispersion[2] += rate * (mean_square - joint.dispersion[2])


@kernel
def count_alone(world, listed):
    """Moving averages: of how many tracks only a set watches; of how many somebody else watches, at its start."""
    joint = world.joint_posterior
    for a in range(joint.members.shape[0]):
        alone, others = 0.0, 0.0
        for c in range(listed):
            alone += class_of(joint.members[a], joint.watchers[c]) == ALONE
            others += joint.watchers[c] & ~joint.members[a] != 0
        if np.isnan(joint.alone_count[a]):
            joint.alone_count[a], joint.others_count[a] = alone, others
        else:
            joint.alone_count[a] += 0.1 * (alone - joint.alone_count[a])


@kernel
def weigh_counts(world):
    """ln NB((1-φ) n; μ, k) - ln NB(n; μ, k) - cost, clipped: the share φ of n tracks that only A watches is
    false, against none.
    """
    joint, d = world.joint_posterior, world.joint_posterior.dispersion
    inverse = min(10.0, max(0.1, (d[0] - d[1] + 1.0) / (d[2] + 2.0)))
    for a in range(joint.members.shape[0]):
        others, n = joint.others_count[a], joint.alone_count[a]
        mean = (others + 1.0) / (joint.others_area[a] + 0.1) * (joint.alone_area[a] + 0.02)
        k = 1.0 / (inverse + 1.0 / (others + 1.0))
        whole = log_negative_binomial(n, k, mean)
        for x in range(joint.count_gain.shape[1]):
            share = joint.share[joint.first[ALONE] + x * (joint.first[1] * joint.modes)]
            gain = 0.0
            if a > 0 and share > 0.1 and joint.counts != 0.0:
                gain = log_negative_binomial(n * (1.0 - share), k, mean) - whole - joint.count_cost
                gain = min(joint.cap_count, max(-joint.cap_count, gain))
            joint.count_gain[a, x] = gain


@inlined
def log_negative_binomial(n, k, mean):
    """ln of the negative binomial at n (real) with a mean and a dispersion k, variance mean + mean²/k."""
    odds = math.lgamma(n + k) - math.lgamma(k) - math.lgamma(n + 1.0)
    return odds + k * math.log(k / (k + mean)) + n * math.log(mean / (k + mean))
