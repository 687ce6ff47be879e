"""What a track's motion and the fit of its hits say: whether it stands still, or fits better than sensors do."""

from __future__ import annotations

import math

from trust_env.compiled.kernels import inlined, kernel
from trust_env.defenses.joint.hypotheses import EXACT, PLAIN, STANDING
from trust_env.defenses.joint.looks import FIT_AGE, LARGE_FIT
from trust_env.defenses.joint.patterns import has_several

# Scales of the velocities of targets, as shares of the variance that the tracker gives a new track, the first for
# targets that stand still; and what share of those that move has which.
SCALES = (0.0, 0.1, 1.0, 4.0)
MOVING = (0.1, 0.8, 0.1)
LEAST_KNOWN = 1e-3  # share of the velocity variance of a new track that hits have removed, at least
MARKED = 0.9  # share of a coalition's false tracks that are as its mode says
FIT_RATE, FIT_WEIGHT = 0.02, 20.0  # of the usual d²: its rate of forgetting, and the weight of its prior in hits


@kernel
def weigh_motion(world, j):
    """`motion[J, C]`: likelihoods of column j's motion by scale of velocity, relative to the greatest.

    The estimate v̂ with variance P comes from the prior N(0, V I), V being that of a new track. Without the prior
    it is v̂/(1 - P/V) with variance PV/(V - P), which under scale c is N(0, (σ_c² + PV/(V - P)) I).
    """
    joint, mean, cov, prior = (
        world.joint_posterior,
        world.tracks.mean[j],
        world.tracks.cov[j],
        world.parameters.velocity_variance,
    )
    variance = max(0.5 * (cov[2, 2] + cov[3, 3]), 1e-9 * prior)
    known = max(1.0 - variance / prior, LEAST_KNOWN)
    squared, variance = (mean[2] * mean[2] + mean[3] * mean[3]) / (known * known), variance / known
    joint.motion[j, 0] = top = joint.stands[j]
    for s in range(1, joint.scales.shape[0]):
        own, usual = variance + joint.scales[s] * prior, variance + prior
        joint.motion[j, s] = math.log(usual / own) - 0.5 * squared * (1.0 / own - 1.0 / usual)
        top = max(top, joint.motion[j, s])
    for s in range(joint.scales.shape[0]):
        joint.motion[j, s] = math.exp(joint.motion[j, s] - top)


@kernel
def weigh_fit(world, j):
    """`exact[J]`: likelihood ratio of reports with the share τ of the usual d² to honest ones.

    (D/λ)(1 - 1/τ) - N ln τ with D = Σ d²/2 over N hits and λ the usual d²/2, clipped.
    """
    joint, total, hits = world.joint_posterior, 0.0, 0.0
    for k in range(joint.hits.shape[0]):
        total += 0.5 * joint.fit[k, j]
        hits += joint.fits[k, j]
    usual = (joint.usual_fit + FIT_WEIGHT) / (joint.usual_fits + FIT_WEIGHT)
    ratio = total / usual * (1.0 - 1.0 / joint.tau) - hits * math.log(joint.tau)
    joint.exact[j] = math.exp(min(joint.cap_fit, max(-joint.cap_fit, ratio)))


@inlined
def motion_of_real(world, j, a):
    """Likelihood of the motion of a real track, by the tracks that set a's urn has seen."""
    urn, motion, total, likelihood = world.joint_posterior.urn_now[a], world.joint_posterior.motion[j], 0.0, 0.0
    for s in range(urn.shape[0]):
        total += urn[s]
        likelihood += urn[s] * motion[s]
    return likelihood / total


@inlined
def learn_motion(world, j, a):
    """The urn of set a takes a real track, one in all, shared among the scales."""
    urn, motion, total = world.joint_posterior.urn_now[a], world.joint_posterior.motion[j], 0.0
    for s in range(urn.shape[0]):
        total += urn[s] * motion[s]
    for s in range(urn.shape[0]):
        urn[s] += urn[s] * motion[s] / total


@kernel
def weigh_modes(world, c, j, a):
    """`mark[c, A, mode]`: likelihood ratios of a false track of set a to one that is like real ones."""
    joint, mark = world.joint_posterior, world.joint_posterior.mark[c, a]
    limit, real = joint.most_motion, motion_of_real(world, j, a)
    standing = min(limit, max(1.0 / limit, joint.motion[j, 0] / max(real, 1e-300)))
    mark[PLAIN] = 1.0
    mark[STANDING] = 1.0 - MARKED + MARKED * standing
    mark[EXACT] = 1.0 - MARKED + MARKED * joint.exact[j]


@kernel
def learn_fit(world, c, j, trust):
    """The usual d²/2 of tracks that several agents hit, weighted by trust in the track."""
    joint = world.joint_posterior
    if has_several(joint.hitters[c]) and world.tracks.age[j] >= FIT_AGE:
        for k in range(joint.hits.shape[0]):
            distance2 = world.evidence.distance2[k, j]
            if distance2 >= 0.0:
                joint.usual_fit += trust * 0.5 * min(distance2, LARGE_FIT)
                joint.usual_fits += trust
