"""How many tracks only a set of agents watches, against what the area that only they cover would hold."""

from __future__ import annotations

import math

import numpy as np

from trust_env.compiled.kernels import inlined, kernel
from trust_env.defenses.joint.hypotheses import ALONE, TOGETHER
from trust_env.defenses.joint.patterns import class_of, has_several

RATE = 0.1  # of the moving averages of counts
LEAST_RATE = 0.02  # of the dispersion
LEAST_AREA = 0.01  # of a region whose tracks tell of the dispersion
MOST_SHARE = 0.95  # of false tracks in a region
AREA_FLOOR, OTHERS_FLOOR = 0.02, 0.1  # added to areas, which are shares of what is covered
LEAST_DISPERSION, MOST_DISPERSION = 0.1, 10.0


@kernel
def survey(world):
    """Areas as shares of what is covered: of regions that the same agents cover; for every set what only it
    covers, and what somebody outside it covers. Again whenever poses have changed.
    """
    joint, pose, moved = world.joint_posterior, world.agents.pose, False
    for k in range(pose.shape[0]):
        for axis in range(3):
            moved |= joint.pose[k, axis] != pose[k, axis]  # NaN, at first, differs from everything
            joint.pose[k, axis] = pose[k, axis]
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
    joint, covered, total = world.joint_posterior, world.evidence.covered, 0.0
    joint.regions = 0
    for cell in range(covered.shape[1]):
        watchers = 0
        for k in range(covered.shape[0]):
            if covered[k, cell]:
                watchers |= 1 << k
        if watchers != 0:
            joint.region_area[_region_of(world, watchers)] += 1.0
            total += 1.0
    for q in range(joint.regions):
        joint.region_area[q] /= total


@kernel
def _region_of(world, watchers):
    """The place of the region that these agents cover, a new one if there is none yet."""
    joint = world.joint_posterior
    for q in range(joint.regions):
        if joint.region[q] == watchers:
            return q
    joint.region[joint.regions], joint.region_area[joint.regions] = watchers, 0.0
    joint.gone_region[joint.regions] = 0.0
    joint.regions += 1
    return joint.regions - 1


@kernel
def count_tracks(world, listed):
    """Tracks by region, and how many lie in regions that only a set covers; those that are gone count, too."""
    joint = world.joint_posterior
    for q in range(joint.regions):
        joint.region_count[q] = joint.gone_region[q]
        for c in range(listed):
            joint.region_count[q] += joint.region[q] == joint.watchers[c]
    for a in range(joint.members.shape[0]):
        joint.alone_found[a] = 0.0
        for q in range(joint.regions):
            if joint.region[q] & ~joint.members[a] == 0:
                joint.alone_found[a] += joint.region_count[q]


@kernel
def learn_dispersion(world, listed):
    """How much more the counts of tracks in regions with several watchers vary than a Poisson's: the means of
    (n - μ)², μ and μ², with μ the region's part of all tracks in such regions.
    """
    joint, tracks, area = world.joint_posterior, 0.0, 0.0
    for c in range(listed):
        tracks += has_several(joint.watchers[c])
    for q in range(joint.regions):
        if has_several(joint.region[q]):
            area += joint.region_area[q]
            tracks += joint.gone_region[q]
    density, square, mean, mean_square = (tracks + 0.5) / (area + 0.05), 0.0, 0.0, 0.0
    for q in range(joint.regions):
        if has_several(joint.region[q]) and joint.region_area[q] > LEAST_AREA:
            expected = density * joint.region_area[q]
            square += (joint.region_count[q] - expected) ** 2
            mean += expected
            mean_square += expected * expected
    joint.frames += 1.0
    rate = max(LEAST_RATE, 1.0 / joint.frames)
    joint.dispersion[0] += rate * (square - joint.dispersion[0])
    joint.dispersion[1] += rate * (mean - joint.dispersion[1])
    joint.dispersion[2] += rate * (mean_square - joint.dispersion[2])


@kernel
def count_alone(world, listed):
    """Moving averages of how many tracks only a set watches; at first, too, of how many somebody else watches."""
    joint = world.joint_posterior
    for a in range(joint.members.shape[0]):
        alone, others = 0.0, 0.0
        for c in range(listed):
            alone += class_of(joint.members[a], joint.watchers[c]) == ALONE
            others += joint.watchers[c] & ~joint.members[a] != 0
        if np.isnan(joint.alone_count[a]):
            joint.alone_count[a], joint.others_count[a] = alone, others
        else:
            joint.alone_count[a] += RATE * (alone - joint.alone_count[a])


@kernel
def count_gone(world, c, real):
    """A track that is gone still counts."""
    joint = world.joint_posterior
    for a in range(joint.members.shape[0]):
        joint.gone_alone[a] += class_of(joint.members[a], joint.watchers[c]) == ALONE
        if joint.watchers[c] & ~joint.members[a] != 0:
            joint.gone_others[a] += real
    for q in range(joint.regions):
        if joint.region[q] == joint.watchers[c]:
            joint.gone_region[q] += 1.0


@kernel
def spread_shares(world, c):
    """`share_now[A]`: the shares φ of false tracks by who of A watches the track in place c.

    Where only A watches, real tracks spread by area, so that of n_A such tracks, on the area x_A, (1-φ) n_A a_q/x_A
    are real ones in a region of area a_q; the others of the n_q tracks there are false.
    """
    joint, region = world.joint_posterior, -1
    for q in range(joint.regions):
        if joint.region[q] == joint.watchers[c]:
            region = q
    for a in range(joint.members.shape[0]):
        watched = class_of(joint.members[a], joint.watchers[c])
        if watched == ALONE:
            _spread_share(world, a, region)
        elif watched == TOGETHER:
            for x in range(joint.together_share.shape[0]):
                joint.share_now[a, x] = joint.together_share[x]
        else:
            joint.share_now[a, 0] = joint.natural


@kernel
def _spread_share(world, a, region):
    joint, now, real = world.joint_posterior, world.joint_posterior.share_now[a], 1.0
    spread = region >= 0 and joint.region_count[region] > 0.0
    if spread:
        area = (joint.region_area[region] + AREA_FLOOR) / (joint.alone_area[a] + AREA_FLOOR)
        real = joint.alone_found[a] * area / joint.region_count[region]
    now[0] = joint.alone_share[0]
    for x in range(1, joint.alone_share.shape[0]):
        now[x] = joint.alone_share[x]
        if spread:
            now[x] = min(MOST_SHARE, max(now[0], 1.0 - (1.0 - now[x]) * real))


@kernel
def weigh_counts(world):
    """`count_ratio[A, X]`: how much better a share φ of false tracks explains the count n of those that only A watches.

    NB((1-φ) n; μ, k)/NB(n; μ, k), its logarithm clipped, for φ above the least, with μ = (M + 1)/(B + .1) (x + .02):
    M the tracks that others watch, B the area that they cover, x the area that only A covers. 1/k is the learnt
    dispersion plus 1/(M + 1), as M is uncertain itself.
    """
    joint, d = world.joint_posterior, world.joint_posterior.dispersion
    inverse = min(MOST_DISPERSION, max(LEAST_DISPERSION, (d[0] - d[1] + 1.0) / (d[2] + 2.0)))
    for a in range(joint.members.shape[0]):
        others, n = joint.others_count[a] + joint.gone_others[a], joint.alone_count[a] + joint.gone_alone[a]
        mean = (others + 1.0) / (joint.others_area[a] + OTHERS_FLOOR) * (joint.alone_area[a] + AREA_FLOOR)
        k = 1.0 / (inverse + 1.0 / (others + 1.0))
        joint.count_ratio[a, 0] = 1.0
        whole = log_negative_binomial(n, k, mean)
        for x in range(1, joint.alone_share.shape[0]):
            joint.count_ratio[a, x] = 1.0
            if joint.counts != 0.0 and n > 0.0:
                gain = log_negative_binomial(n * (1.0 - joint.alone_share[x]), k, mean) - whole
                joint.count_ratio[a, x] = math.exp(min(joint.cap_count, max(-joint.cap_count, gain)))


@inlined
def log_negative_binomial(n, k, mean):
    """ln of the negative binomial with this mean and variance mean + mean²/k at n, any real number from 0 on; the
    part that depends on n.
    """
    return math.lgamma(n + k) - math.lgamma(n + 1.0) + n * math.log(mean / (k + mean))
