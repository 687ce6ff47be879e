"""`dawid_skene`: which tracks are real and how each agent errs, by expectation maximisation."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from trust_env.compiled.kernels import inlined, kernel
from trust_env.defenses.base import BuiltIn
from trust_env.defenses.checks import beta_prior, number
from trust_env.defenses.looks import LOOKS, believe, count_looks, forget_all, looks_at

_REAL_HIT, _REAL_MISS, _FAKE_HIT, _FAKE_MISS = range(4)
_MOST_NATS = 500.0  # beyond which e^x overflows


class DawidSkene(BuiltIn):
    """Streaming expectation maximisation over tracks and the agents' rates of error (after Dawid & Skene 1979).

    A track is real with probability z: logit z = logit p + Σ_k h ln(a/b) + (n - h) ln((1-a)/(1-b)), n looks of
    agent k and h hits, which forget by γ at each look; a and b are the agent's probabilities of a hit on a real
    and on a fake track: means of Beta posteriors with four sums, z and 1 - z of the hits and of the misses, which
    decay by ρ each frame. An agent's trust is a - b, at least 0. A control: what a local majority says is its
    truth.

    p: prior of z, in (0, 1); rho: in (0, 1]; gamma: in (0, 1]; real, fake: (α, β) of the priors of a and b.
    Raises ValueError outside these ranges. After Dawid & Skene, "Maximum likelihood estimation of observer
    error-rates using the EM algorithm", Applied Statistics 28(1), 1979.
    """

    parameters: ClassVar = {
        "p": "f8", "rho": "f8", "gamma": "f8", "real": "f8 2 | α, β of a", "fake": "f8 2 | α, β of b",
    }  # fmt: skip
    memory: ClassVar = {**LOOKS, "sums": "f8 K 4 | hits and misses on real, then on fake tracks"}

    def __init__(
        self,
        p: float = 0.8,
        rho: float = 0.98,
        gamma: float = 0.9,
        real: tuple[float, float] = (9.0, 1.0),
        fake: tuple[float, float] = (0.5, 9.5),
    ):
        self._params = {
            "p": number("dawid_skene", "p", p, 0.0, 1.0, "()"),
            "rho": number("dawid_skene", "rho", rho, 0.0, 1.0, "(]"),
            "gamma": number("dawid_skene", "gamma", gamma, 0.0, 1.0, "(]"),
            "real": beta_prior("dawid_skene", "real", real),
            "fake": beta_prior("dawid_skene", "fake", fake),
        }

    def params(self) -> dict[str, Any]:
        return dict(self._params)

    def values(self, n_agents: int) -> dict[str, Any]:
        return self._params

    @staticmethod
    @kernel
    def reset(world):
        """Nothing counted."""
        forget_all(world.dawid_skene)
        for k in range(world.dawid_skene.sums.shape[0]):
            for side in range(4):
                world.dawid_skene.sums[k, side] = 0.0

    @staticmethod
    @kernel
    def judge(world):
        """Tracks by what is known of the agents (E), then agents by the tracks that they look at (M)."""
        sums, listed = world.dawid_skene.sums, count_looks(world, world.dawid_skene, world.dawid_skene.gamma)
        for c in range(listed):
            believe(world, world.scratch.listing[c], _probability(world, world.scratch.listing[c]))
        for k in range(sums.shape[0]):
            for side in range(4):
                sums[k, side] *= world.dawid_skene.rho
            for c in range(listed):
                _add(world, k, world.scratch.listing[c])
            a, b = _hit_rates(world, k)
            world.verdict.agent_trust[k] = max(0.0, a - b)


@inlined
def _hit_rates(world, k):
    """a and b of an agent."""
    sums, real, fake = world.dawid_skene.sums[k], world.dawid_skene.real, world.dawid_skene.fake
    a = (real[0] + sums[_REAL_HIT]) / (real[0] + real[1] + sums[_REAL_HIT] + sums[_REAL_MISS])
    b = (fake[0] + sums[_FAKE_HIT]) / (fake[0] + fake[1] + sums[_FAKE_HIT] + sums[_FAKE_MISS])
    return a, b


@kernel
def _probability(world, j):
    """z of a track."""
    memory = world.dawid_skene
    logit = math.log(memory.p / (1.0 - memory.p))
    for k in range(memory.sums.shape[0]):
        a, b = _hit_rates(world, k)
        misses = memory.looks[k, j] - memory.hits[k, j]
        logit += memory.hits[k, j] * math.log(a / b) + misses * math.log((1.0 - a) / (1.0 - b))
    return 1.0 / (1.0 + math.exp(-min(max(logit, -_MOST_NATS), _MOST_NATS)))


@kernel
def _add(world, k, j):
    """A look of this frame to the agent's sums."""
    if looks_at(world, k, j):
        real, sums = world.verdict.track_trust[j], world.dawid_skene.sums
        hit = world.evidence.hit[k, j]
        sums[k, _REAL_HIT if hit else _REAL_MISS] += real
        sums[k, _FAKE_HIT if hit else _FAKE_MISS] += 1.0 - real
