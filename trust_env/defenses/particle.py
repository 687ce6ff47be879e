"""`particle`: particles of each agent's reliability, judged against the trust-weighted vote of the others."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from trust_env.compiled.kernels import inlined, kernel
from trust_env.defenses.base import BuiltIn
from trust_env.defenses.checks import number, whole
from trust_env.defenses.looks import VOTES, count_agreements, judge_by_votes, reset_votes
from trust_env.world.random import DEFENSE, key_of, normal, uniform, words
from trust_env.world.tracking.track_store import list_confirmed

_EDGE = 1e-9  # particles stay this far from 0 and 1, where a logarithm ends


class Particle(BuiltIn):
    """A particle filter over each agent's reliability r, from agreement with the others' vote (bissmeyer2012-style).

    Each frame every particle moves by N(0, sigma²), reflected at 0 and 1, and its weight is multiplied by
    r^a (1 - r)^b, a and b the looks at which the agent agreed, and did not, with the vote of the other agents
    that look at the same track, weighted by their trust of the frame before. Below an effective sample size
    1/Σw² of n/2 the particles are resampled systematically. An agent's trust is the weighted mean of r. A
    track's trust is a moving average, over `window` frames with at least two lookers, of the share of hits,
    weighted by trust.

    n: particles of an agent, from 2 to 10000; sigma: from 0 to 0.5; window: frames, from 1 to 1000. Raises
    ValueError outside these ranges. Reconstructed after the idea of the publication, not after its equations.
    """

    parameters: ClassVar = {"sigma": "f8", "window": "i8 | frames"}
    memory: ClassVar = {**VOTES, "r": "f8 K M", "w": "f8 K M | of the particles, sum 1"}
    scratch: ClassVar = {"drawn": "f8 M"}

    def __init__(self, n: int = 200, sigma: float = 0.02, window: int = 10):
        self.n = whole("particle", "n", n, 2, 10_000)
        self.sigma = number("particle", "sigma", sigma, 0.0, 0.5)
        self.window = whole("particle", "window", window, 1, 1000)

    def params(self) -> dict[str, Any]:
        return {"n": self.n, "sigma": self.sigma, "window": self.window}

    def values(self, n_agents: int) -> dict[str, Any]:
        return {"sigma": self.sigma, "window": self.window}

    def lengths(self, n_agents: int) -> dict[str, int]:
        return {"M": self.n}

    @staticmethod
    @kernel
    def reset(world):
        """Particles spread evenly over [0, 1]."""
        memory, n = world.particle, world.particle.drawn.shape[0]
        reset_votes(memory, 0.5)
        for k in range(memory.r.shape[0]):
            for i in range(n):
                memory.r[k, i], memory.w[k, i] = (i + 0.5) / n, 1.0 / n

    @staticmethod
    @kernel
    def judge(world):
        """Agents by the trust of the frame before, then tracks by the new one."""
        memory, listed = world.particle, list_confirmed(world)
        count_agreements(world, memory, listed)
        for k in range(memory.r.shape[0]):
            _move(world, k)
            _weigh(world, k)
            _conclude(world, k)
            _resample(world, k)
        judge_by_votes(world, memory, listed, memory.window)


@inlined
def _reflected(r):
    """r mirrored at 0 and at 1."""
    r = abs(r)
    r = 2.0 - r if r > 1.0 else r
    return min(max(r, _EDGE), 1.0 - _EDGE)


@kernel
def _move(world, k):
    """r + N(0, sigma²) of agent k's particles, four from each draw."""
    r, sigma, key = world.particle.r[k], world.particle.sigma, key_of(world)
    n = r.shape[0]
    draws = (n + 3) // 4
    for d in range(draws):
        drawn = words(key, DEFENSE, world.clock.frame, k * (draws + 1) + d)
        for part in range(min(4, n - 4 * d)):
            r[4 * d + part] = _reflected(r[4 * d + part] + sigma * normal(drawn[part]))


@kernel
def _weigh(world, k):
    """w ← w r^a (1 - r)^b, with sum 1."""
    memory, a, b = world.particle, world.particle.agreement[k, 0], world.particle.agreement[k, 1]
    total, most = 0.0, -math.inf
    for i in range(memory.drawn.shape[0]):  # logarithms, and their greatest, as many looks underflow
        memory.drawn[i] = a * math.log(memory.r[k, i]) + b * math.log1p(-memory.r[k, i])
        most = max(most, memory.drawn[i])
    for i in range(memory.drawn.shape[0]):
        memory.w[k, i] *= math.exp(memory.drawn[i] - most)
        total += memory.w[k, i]
    for i in range(memory.drawn.shape[0]):
        memory.w[k, i] /= total


@kernel
def _conclude(world, k):
    """Mean and variance of r."""
    memory, mean, square = world.particle, 0.0, 0.0
    for i in range(memory.drawn.shape[0]):
        mean += memory.w[k, i] * memory.r[k, i]
        square += memory.w[k, i] * memory.r[k, i] ** 2
    memory.weight[k] = mean
    world.verdict.agent_trust[k], world.verdict.agent_trust_var[k] = mean, max(0.0, square - mean * mean)


@kernel
def _resample(world, k):
    """Systematic resampling, where the effective sample size is below n/2."""
    memory, n, squares = world.particle, world.particle.drawn.shape[0], 0.0
    for i in range(n):
        squares += memory.w[k, i] ** 2
    if 1.0 / squares >= 0.5 * n:
        return
    start = uniform(key_of(world), DEFENSE, world.clock.frame, k * ((n + 3) // 4 + 1) + (n + 3) // 4)
    at, reached = 0, memory.w[k, 0]
    for i in range(n):
        while reached < (i + start) / n and at < n - 1:
            at += 1
            reached += memory.w[k, at]
        memory.drawn[i] = memory.r[k, at]
    for i in range(n):
        memory.r[k, i], memory.w[k, i] = memory.drawn[i], 1.0 / n
