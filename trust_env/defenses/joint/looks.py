"""Looks of agents at tracks, from a track's birth, slowly forgotten: hits, misses, how hits fit, where they lie."""

from __future__ import annotations

import math

import numpy as np

from trust_env.compiled.kernels import inlined, kernel
from trust_env.world.tracking.track_store import EMPTY

LARGE_FIT = 9.0  # d² from which on all hits fit equally badly
FIT_AGE = 3  # frames from which on d² says something: before, the filter is young
LEAST_INSIDE = 0.01  # negligible probability that a track lies in an FOV
MOST_ABSENT = 8.0  # looks
MOST_MOTION = 10.0  # nats
MOST_LOSS = 3.0  # nats, by one hit, which may be another target's
MEAN_HITS = 50.0  # over which the mean of a track's hits is taken


@kernel
def forget_track(world, j):
    """Column j begins with nothing."""
    joint = world.joint_posterior
    joint.track_id[j], joint.was_listed[j], joint.absent[j] = world.tracks.id[j], False, 0.0
    joint.stands[j], joint.mean_hits[j] = 0.0, 0.0
    for k in range(joint.hits.shape[0]):
        joint.hits[k, j], joint.looks[k, j], joint.seen[k, j] = 0.0, 0.0, 0.0
        joint.fit[k, j], joint.fits[k, j] = 0.0, 0.0


@kernel
def count_looks(world):
    """Hits h, looks n and the log-likelihood of a real track, all of which forget by γ at each look.

    With p the probability that the track lies in the FOV, a hit says ln(P_D p) and a miss ln(1 - P_D p²), which is
    ln(1 - P_D p²)/ln(1 - P_D) of a look: p², as a track near the edge stays there for a while, and misses in a row
    are not independent. Not to be hit where p is negligible is no look, nor is it to be detected and not hit: another
    track may have taken the detection.
    """
    evidence = world.evidence
    for j in range(world.tracks.count):
        if world.tracks.status[j] != EMPTY:
            for k in range(evidence.hit.shape[0]):
                if evidence.hit[k, j]:
                    _count_hit(world, k, j)
                elif not evidence.detected[k, j] and _in_view(world, k, j) > LEAST_INSIDE:
                    _count_miss(world, k, j)


@inlined
def _in_view(world, k, j):
    """p; without edges 1 for all that the FOV is expected to hold."""
    if world.joint_posterior.edges == 0.0:
        return 1.0 if world.evidence.expected[k, j] or world.evidence.hit[k, j] else 0.0
    return world.evidence.inside[k, j]


@kernel
def _count_hit(world, k, j):
    joint, gamma, distance2 = world.joint_posterior, world.joint_posterior.gamma, world.evidence.distance2[k, j]
    inside = max(_in_view(world, k, j), LEAST_INSIDE)
    joint.hits[k, j], joint.looks[k, j] = gamma * joint.hits[k, j] + 1.0, gamma * joint.looks[k, j] + 1.0
    joint.seen[k, j] = gamma * joint.seen[k, j] + math.log(world.agents.believed_p_detect[k] * inside)
    if world.tracks.age[j] >= FIT_AGE and not np.isnan(distance2):
        joint.fit[k, j] = gamma * joint.fit[k, j] + min(distance2, LARGE_FIT)
        joint.fits[k, j] = gamma * joint.fits[k, j] + 1.0


@kernel
def _count_miss(world, k, j):
    joint, gamma = world.joint_posterior, world.joint_posterior.gamma
    missed = math.log1p(-world.agents.believed_p_detect[k] * _in_view(world, k, j) ** 2)
    joint.hits[k, j] *= gamma
    joint.looks[k, j] = gamma * joint.looks[k, j] + missed / world.agents.miss_gain[k]
    joint.seen[k, j] = gamma * joint.seen[k, j] + missed


@kernel
def compare_motions(world):
    """`stands[J]`: by how many nats a point that stands still explains a track's hits better than its filter does.

    Σ ln N(z; z̄, (1 + 1/N) R) - ln N(ν; 0, S) over the hits z, z̄ being the mean of the N before.
    """
    evidence = world.evidence
    for k in range(evidence.assignment.shape[0]):
        for d in range(world.reports.count[k]):
            j = evidence.assignment[k, d]
            if j >= 0 and not np.isnan(evidence.distance2[k, j]):
                _compare_hit(world, k, j, world.reports.detections[k, d])


@kernel
def _compare_hit(world, k, j, point):
    joint, noise, mean = world.joint_posterior, world.agents.noise_cov[k], world.joint_posterior.mean_position[j]
    n = joint.mean_hits[j]
    if n == 0.0:
        mean[0], mean[1] = point[0], point[1]
    else:
        cov, dx, dy = world.evidence.innovation_cov[k, j], point[0] - mean[0], point[1] - mean[1]
        det = noise[0, 0] * noise[1, 1] - noise[0, 1] * noise[1, 0]
        squared = (noise[1, 1] * dx * dx - 2.0 * noise[0, 1] * dx * dy + noise[0, 0] * dy * dy) / det / (1.0 + 1.0 / n)
        volumes = (cov[0, 0] * cov[1, 1] - cov[0, 1] * cov[1, 0]) / (det * (1.0 + 1.0 / n) ** 2)
        gain = 0.5 * (world.evidence.distance2[k, j] - squared + math.log(volumes))
        joint.stands[j] = min(MOST_MOTION, max(-MOST_MOTION, joint.stands[j] + max(-MOST_LOSS, gain)))
    n = min(MEAN_HITS, n + 1.0)
    joint.mean_hits[j] = n
    mean[0] += (point[0] - mean[0]) / n
    mean[1] += (point[1] - mean[1]) / n


@kernel
def count_absence(world, j):
    """u_j: trust of the watchers that missed the track since an agent that is trusted hit it."""
    joint, best, missed = world.joint_posterior, 0.0, 0.0
    for k in range(joint.hits.shape[0]):
        if world.evidence.hit[k, j]:
            best = max(best, world.verdict.agent_trust[k])
        elif world.evidence.expected[k, j] and not world.evidence.detected[k, j]:
            missed += world.verdict.agent_trust[k]
    joint.absent[j] = 0.0 if best > 0.5 else min(MOST_ABSENT, joint.absent[j] + missed * (1.0 - best))
