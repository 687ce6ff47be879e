"""Looks of agents at tracks: hits, misses, and how well hits fit, from a track's birth, slowly forgotten."""

from __future__ import annotations

import math

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.world.tracking.track_store import EMPTY

_LARGE_FIT = 9.0  # d² from which on a hit fits equally badly
_FIT_AGE = 3  # frames from which on d² says something: before, it is that of a young filter
_LEAST_IN_VIEW = 1e-3
_MOST_MISSES = 8.0
_MOST_MOTION = 20.0  # nats
_SPOT_HITS = 50.0


@kernel
def forget_track(world, j):
    """Nothing is known of column j."""
    joint = world.joint_posterior
    joint.track_id[j], joint.was_listed[j], joint.absent[j] = world.tracks.id[j], False, 0.0
    joint.stands[j], joint.spot_hits[j] = 0.0, 0.0
    for k in range(joint.hits.shape[0]):
        joint.hits[k, j], joint.looks[k, j], joint.fit[k, j], joint.fits[k, j] = 0.0, 0.0, 0.0, 0.0
        joint.seen[k, j] = 0.0


@kernel
def count_looks(world):
    """Hits h and looks n, and the log-likelihood of a real track, all of which forget by γ at each look.

    With p the probability that the track lies in the FOV, a hit says ln(P_D p) and a miss ln(1 - P_D p), which is
    ln(1 - P_D p)/ln(1 - P_D) of a look. Expected, not hit and yet detected is no look: the detection may be another
    track's.
    """
    for j in range(world.tracks.count):
        if world.tracks.status[j] != EMPTY:
            for k in range(world.evidence.expected.shape[0]):
                if not np.isnan(world.evidence.distance2[k, j]):
                    _count_hit(world, k, j)
                elif world.evidence.expected[k, j] and not world.evidence.detected[k, j]:
                    _count_miss(world, k, j)


@kernel
def _count_hit(world, k, j):
    joint, gamma = world.joint_posterior, world.joint_posterior.gamma
    p_detect = -math.expm1(world.agents.miss_gain[k])
    joint.hits[k, j], joint.looks[k, j] = gamma * joint.hits[k, j] + 1.0, gamma * joint.looks[k, j] + 1.0
    joint.seen[k, j] = gamma * joint.seen[k, j] + math.log(p_detect * max(in_view(world, k, j), _LEAST_IN_VIEW))
    if world.tracks.age[j] >= _FIT_AGE:
        joint.fit[k, j] = gamma * joint.fit[k, j] + min(world.evidence.distance2[k, j], _LARGE_FIT)
        joint.fits[k, j] = gamma * joint.fits[k, j] + 1.0


@kernel
def _count_miss(world, k, j):
    joint, gamma, miss_gain = world.joint_posterior, world.joint_posterior.gamma, world.agents.miss_gain[k]
    missed = math.log1p(math.expm1(miss_gain) * in_view(world, k, j))
    joint.hits[k, j] *= gamma
    joint.looks[k, j] = gamma * joint.looks[k, j] + missed / miss_gain
    joint.seen[k, j] = gamma * joint.seen[k, j] + missed


@kernel
def in_view(world, k, j):
    """p, the probability that track j lies in the FOV of agent k."""
    if world.joint_posterior.edges == 0.0:
        return 1.0
    mean, cov, pose = world.tracks.mean[j], world.tracks.cov[j], world.agents.pose[k]
    distance = math.hypot(mean[0] - pose[0], mean[1] - pose[1])
    sigma = math.sqrt(max(cov[0, 0], cov[1, 1]))
    return 0.5 * math.erfc(-(world.agents.fov_radius[k] - distance) / max(sigma, 1e-9) / math.sqrt(2.0))


@kernel
def compare_motions(world):
    """`stands[J]`: ln of how much better a point that stands still explains a track's hits than its filter does.

    Σ ln N(z; z̄, (1 + 1/N) R) - ln N(ν; 0, S) over the hits z, z̄ being the mean of the N before.
    """
    joint, evidence = world.joint_posterior, world.evidence
    for k in range(evidence.assignment.shape[0]):
        for d in range(world.reports.count[k]):
            j = evidence.assignment[k, d]
            if j >= 0 and not np.isnan(evidence.distance2[k, j]):
                _compare_hit(world, k, j, world.reports.detections[k, d])


@kernel
def _compare_hit(world, k, j, point):
    joint, noise, cov = world.joint_posterior, world.agents.noise_cov[k], world.evidence.innovation_cov[k, j]
    spot, n = joint.spot[j], joint.spot_hits[j]
    dx, dy = point[0] - spot[0], point[1] - spot[1]
    if n > 0.0:
        scale, det = 1.0 + 1.0 / n, noise[0, 0] * noise[1, 1] - noise[0, 1] * noise[1, 0]
        squared = (noise[1, 1] * dx * dx - 2.0 * noise[0, 1] * dx * dy + noise[0, 0] * dy * dy) / det / scale
        moving = cov[0, 0] * cov[1, 1] - cov[0, 1] * cov[1, 0]
        gain = 0.5 * (world.evidence.distance2[k, j] - squared + math.log(moving / (det * scale * scale)))
        joint.stands[j] = min(_MOST_MOTION, max(-_MOST_MOTION, joint.stands[j] + gain))
    else:
        spot[0], spot[1] = point[0], point[1]
        dx, dy = 0.0, 0.0
    joint.spot_hits[j] = min(_SPOT_HITS, n + 1.0)
    spot[0] += dx / joint.spot_hits[j]
    spot[1] += dy / joint.spot_hits[j]


@kernel
def count_absence(world, j):
    """u_j: trust of the watchers that missed since an agent that is trusted hit the track."""
    joint, best, missed = world.joint_posterior, 0.0, 0.0
    for k in range(joint.hits.shape[0]):
        trust = world.verdict.agent_trust[k]
        if not np.isnan(world.evidence.distance2[k, j]):
            best = max(best, trust)
        elif world.evidence.expected[k, j] and not world.evidence.detected[k, j]:
            missed += trust
    joint.absent[j] = 0.0 if best > 0.5 else min(_MOST_MISSES, joint.absent[j] + missed * (1.0 - best))
