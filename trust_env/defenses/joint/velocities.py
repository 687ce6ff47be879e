"""What a track's velocity and the fit of its hits say about whether it is real."""

from __future__ import annotations

import math

from trust_env.compiled.kernels import inlined, kernel

_LEAST_KNOWN = 1e-3  # share of the velocity variance of a new track that hits must have removed


@kernel
def weigh_velocity(world, j):
    """Likelihoods of column j's motion, standing (scale 0) and moving with every scale of the velocities of
    targets, relative to the greatest.

    The estimate v̂ with variance P comes from the prior N(0, V I), V being that of a new track. Without the prior
    it is v̂/(1 - P/V) with variance PV/(V - P), which under scale c is N(0, (σ_c² + PV/(V - P)) I).
    """
    joint, mean, cov = world.joint_posterior, world.tracks.mean[j], world.tracks.cov[j]
    prior = world.parameters.velocity_variance
    variance = max(0.5 * (cov[2, 2] + cov[3, 3]), 1e-9 * prior)
    known = max(1.0 - variance / prior, _LEAST_KNOWN)
    squared = (mean[2] * mean[2] + mean[3] * mean[3]) / (known * known)
    variance = variance / known
    joint.velocity[j, 0] = top = joint.stands[j]
    for s in range(1, joint.scales.shape[0]):
        total = variance + joint.scales[s] * prior
        usual = variance + prior
        joint.velocity[j, s] = math.log(usual / total) - 0.5 * squared * (1.0 / total - 1.0 / usual)
        top = max(top, joint.velocity[j, s])
    for s in range(joint.scales.shape[0]):
        joint.velocity[j, s] = math.exp(joint.velocity[j, s] - top)
    joint.standing[j] = joint.velocity[j, 0]


@kernel
def weigh_fit(world, j):
    """Likelihood ratio of reports with a share τ of the usual d² to honest ones: reports without noise are too
    good.

    (D/λ)(1 - 1/τ) - N ln τ with D = Σ d²/2, N hits and λ the mean of d²/2, clipped.
    """
    joint, total, hits = world.joint_posterior, 0.0, 0.0
    for k in range(joint.hits.shape[0]):
        total += 0.5 * joint.fit[k, j]
        hits += joint.fits[k, j]
    usual = (joint.fit_sum + joint.fit_weight) / (joint.fit_count + joint.fit_weight)
    ratio = total / usual * (1.0 - 1.0 / joint.tau) - hits * math.log(joint.tau)
    joint.exact[j] = math.exp(min(joint.cap_fit, max(-joint.cap_fit, ratio)))


@inlined
def velocity_of_real(world, j, a):
    """Likelihood of the velocity of a real track under set a, which has seen the urn's tracks."""
    joint, urn, total, likelihood = world.joint_posterior, world.joint_posterior.urn_now[a], 0.0, 0.0
    for s in range(joint.scales.shape[0]):
        total += urn[s]
        likelihood += urn[s] * joint.velocity[j, s]
    return likelihood / total


@inlined
def learn_velocity(world, j, a, weight):
    """The urn of set a takes a real track: a weight of one, shared among the scales."""
    joint, urn, total = world.joint_posterior, world.joint_posterior.urn_now[a], 0.0
    for s in range(joint.scales.shape[0]):
        total += urn[s] * joint.velocity[j, s]
    for s in range(joint.scales.shape[0]):
        urn[s] += weight * urn[s] * joint.velocity[j, s] / total


@kernel
def weigh_modes(world, c, j, a, real):
    """Likelihood ratios, by mode, of a false track of set a to one that is like real ones."""
    joint = world.joint_posterior
    limit, share = math.exp(joint.cap_velocity), joint.marked_share
    standing = min(limit, max(1.0 / limit, joint.standing[j] / max(real, 1e-300)))
    mark = joint.mark[c, a]
    mark[0] = 1.0
    mark[1] = 1.0 - share + share * standing
    mark[2] = 1.0 - share + share * joint.exact[j]
