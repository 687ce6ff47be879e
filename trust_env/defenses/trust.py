"""`trust`: Bayesian trust in tracks and agents (Hallyburton & Pajic 2024, Sec. IV).

Every confirmed track and every agent has a Beta(α, β) belief. A pseudomeasurement (PSM), value v and
confidence c, updates it: α += c v, β += c (1 - v).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.defenses.base import ACCEPT, BuiltIn
from trust_env.defenses.beta_belief import beta_of, mean_of, update_belief, variance_of
from trust_env.defenses.trust_switches import (
    ALL_PSMS,
    ALL_TRACKS,
    BY_VARIANCE,
    DECAY,
    DEFAULT_PRESET,
    NUMBERS,
    PRESETS,
    RETURN,
    SWITCHES,
    TOWARD_PRIOR,
    TRACKS_FIRST,
    UNWEIGHTED,
    as_number,
    check_switches,
)
from trust_env.world.tracking.track_store import list_confirmed

# What the authors' later library weighs a miss by: m of their world, where an FOV has a radius of 70 m.
_RADIUS, _NEAR, _FAR = 70.0, 30.0, 60.0
_LEAST_HITS = 2  # of a track that an agent can be blamed for missing


class Trust(BuiltIn):
    """Beta trust in tracks and agents.

    `preset` is `paper` (as printed), `cdc2024` (the code that drew the paper's figures) or `mate` (the
    authors' later library); every switch of `trust_env.defenses.trust_switches` can be set alone. Priors are
    (mean φ, precision λ): α = λφ, β = λ(1 - φ).

    agent_prior, track_prior: priors of all agents and of all tracks; agent_priors: {agent index: (φ, λ)},
    track_priors: {track id: (φ, λ)}, of single ones; trusted, distrusted: agent indices that get the preset's
    strong prior, mean 0.8 or 0.2. false_positive_odds: how many times likelier, a priori, a false positive of
    who reports a track is than a false negative of who does not; it weighs misses against hits. Raises
    ValueError for an unknown switch or value, or a prior outside its range.
    """

    parameters: ClassVar = {
        **dict.fromkeys(NUMBERS, "f8 | a switch, as `as_number` gives it"),
        "track_prior": "f8 2 | α, β",
        "agent_prior": "f8 K 2 | α, β",
        "listed_id": "i8 V | tracks with a prior of their own",
        "listed_prior": "f8 V 2 | α, β",
    }
    memory: ClassVar = {
        "track_id": "i8 J | whose belief it is; -2 - id until that track has been judged; -1: nobody's",
        "track_belief": "f8 J 2 | α, β",
        "prior_belief": "f8 J 2 | α, β, what a track's belief began with",
        "agent_belief": "f8 K 2 | α, β",
        "frames_in_fov": "i8 K J | in a row",
    }

    def __init__(self, preset: str = DEFAULT_PRESET, **switches: Any):
        self._given = {"preset": preset, **switches}
        self.switches = check_switches(preset, switches)

    def params(self) -> dict[str, Any]:
        return dict(self._given)

    @classmethod
    def presets(cls) -> Mapping[str, Mapping[str, Any]]:
        return PRESETS

    @classmethod
    def choices(cls, parameter: str) -> list[str]:
        return list(SWITCHES[parameter].choices) if parameter in SWITCHES else []

    def values(self, n_agents: int) -> dict[str, Any]:
        numbers = {name: as_number(name, self.switches[name]) for name in NUMBERS}
        priors = {"track_prior": beta_of(self.switches["track_prior"]), "agent_prior": self._priors(n_agents)}
        own = self.switches["track_priors"]
        listed = np.array([beta_of(prior) for prior in own.values()]).reshape(-1, 2)
        return numbers | priors | {"listed_id": np.array(list(own), dtype=np.int64), "listed_prior": listed}

    def lengths(self, n_agents: int) -> dict[str, int]:
        return {"V": len(self.switches["track_priors"])}

    def _priors(self, n_agents: int) -> np.ndarray:
        """(α, β) of every agent, [K, 2]."""
        s = self.switches
        priors = dict.fromkeys(range(n_agents), tuple(s["agent_prior"]))
        trusted = dict.fromkeys(s["trusted"], (0.8, s["strong_precision"]))
        distrusted = dict.fromkeys(s["distrusted"], (0.2, s["strong_precision"]))
        for k, prior in {**trusted, **distrusted, **s["agent_priors"]}.items():
            if not 0 <= k < n_agents:
                agents = f"the agents are 0 to {n_agents - 1}"
                raise ValueError(f"trust: a prior is given for agent {k}, but {agents}")
            priors[k] = tuple(prior)
        return np.array([beta_of(prior) for prior in priors.values()])

    @staticmethod
    @kernel
    def reset(world):
        """All beliefs at their priors."""
        trust = world.trust
        for k in range(trust.agent_belief.shape[0]):
            trust.agent_belief[k, 0], trust.agent_belief[k, 1] = trust.agent_prior[k, 0], trust.agent_prior[k, 1]
        for j in range(trust.track_id.shape[0]):
            trust.track_id[j] = -1

    @staticmethod
    @kernel
    def judge(world):
        """One frame: beliefs forget, then take their PSMs, in the order of the preset; then the verdict."""
        listed = list_confirmed(world)
        _forget_tracks(world, listed)
        _forget_agents(world)
        if world.trust.psm_weights != UNWEIGHTED:
            _count_frames_in_fov(world, listed)
        if world.trust.order == TRACKS_FIRST:
            _judge_tracks(world, listed)
            _judge_agents(world, listed)
        else:
            _judge_agents(world, listed)
            _judge_tracks(world, listed)
        _conclude(world, listed)


@kernel
def _forget(world, belief, alpha, beta, rule):
    """Process noise on one belief whose prior is (alpha, beta)."""
    trust = world.trust
    if rule == DECAY:
        precision = belief[0] + belief[1]
        factor = max(alpha + beta, (1.0 - trust.epsilon) * precision) / precision
        belief[0] *= factor
        belief[1] *= factor
    elif rule in (TOWARD_PRIOR, RETURN):
        weight = trust.prior_rate
        if rule == RETURN:
            weight, alpha, beta = min(1.0, world.clock.dt / trust.dt_return), 0.5, 0.5
        belief[0] += weight * (alpha - belief[0])
        belief[1] += weight * (beta - belief[1])


@kernel
def _forget_tracks(world, listed):
    """Known tracks forget; new ones start at the prior, marked until they have been judged."""
    trust = world.trust
    for c in range(listed):
        j = world.scratch.listing[c]
        prior = trust.prior_belief[j]
        if trust.track_id[j] == world.tracks.id[j]:
            _forget(world, trust.track_belief[j], prior[0], prior[1], trust.track_forgetting)
        else:
            _set_prior(world, j)
            trust.track_belief[j, 0], trust.track_belief[j, 1] = prior[0], prior[1]
            trust.track_id[j] = -2 - world.tracks.id[j]
            for k in range(trust.frames_in_fov.shape[0]):
                trust.frames_in_fov[k, j] = 0


@kernel
def _set_prior(world, j):
    """The prior of a new track: its own, else that of all tracks."""
    trust = world.trust
    trust.prior_belief[j, 0], trust.prior_belief[j, 1] = trust.track_prior[0], trust.track_prior[1]
    for v in range(trust.listed_id.shape[0]):
        if trust.listed_id[v] == world.tracks.id[j]:
            trust.prior_belief[j, 0], trust.prior_belief[j, 1] = trust.listed_prior[v, 0], trust.listed_prior[v, 1]


@kernel
def _forget_agents(world):
    trust = world.trust
    for k in range(trust.agent_belief.shape[0]):
        prior = trust.agent_prior[k]
        _forget(world, trust.agent_belief[k], prior[0], prior[1], trust.agent_forgetting)


@kernel
def _count_frames_in_fov(world, listed):
    frames = world.trust.frames_in_fov
    for k in range(frames.shape[0]):
        for c in range(listed):
            j = world.scratch.listing[c]
            frames[k, j] = frames[k, j] + 1 if world.evidence.expected[k, j] else 0


@kernel
def _miss_weight(world, k, j):
    """w_fov · w_dist · w_age of a negative PSM (the authors' later library), distances in FOV radii."""
    if world.trust.psm_weights == UNWEIGHTED:
        return 1.0
    if world.tracks.hits[j] < _LEAST_HITS:
        return 0.0
    pose, mean, frames = world.agents.pose[k], world.tracks.mean[j], world.trust.frames_in_fov[k, j]
    distance = math.hypot(mean[0] - pose[0], mean[1] - pose[1]) / world.agents.fov_radius[k] * _RADIUS
    if distance <= _NEAR:  # noqa: SIM108 - two rules, one for the near and one for the far
        in_view = 1.0 if frames > 2 else 0.25
    else:
        in_view = min(1.0, max(0.0, (frames - 3) / 3.0))
    return in_view * (0.5 if distance > _FAR else 1.0)


@kernel
def _judge_tracks(world, listed):
    """Alg. 1: every agent that is expected to see a track says whether it does; used when at least two are
    expected. A hit weighs 1 and a miss `false_positive_odds`, scaled so that neither weighs more than 1.
    """
    trust, evidence = world.trust, world.evidence
    odds = trust.false_positive_odds
    hit_weight, miss_weight = min(1.0, 1.0 / odds), min(1.0, odds)
    bias, threshold = trust.track_negativity_bias, trust.negativity_threshold
    for c in range(listed):
        j, observers = world.scratch.listing[c], 0
        for k in range(trust.agent_belief.shape[0]):
            observers += evidence.expected[k, j]
        if observers >= 2:
            for k in range(trust.agent_belief.shape[0]):
                if evidence.expected[k, j]:
                    seen = evidence.detected[k, j]
                    weight = hit_weight if seen else miss_weight * _miss_weight(world, k, j)
                    confidence = mean_of(trust.agent_belief[k]) * weight
                    update_belief(trust.track_belief[j], 1.0 if seen else 0.0, confidence, bias, threshold)


@kernel
def _judge_agents(world, listed):
    """Alg. 2: an agent is as good as the tracks that it holds, and as bad as the good tracks that it does
    not hold.
    """
    trust, columns = world.trust, world.scratch.listing
    bias, threshold = trust.agent_negativity_bias, trust.negativity_threshold
    for k in range(trust.agent_belief.shape[0]):
        belief = trust.agent_belief[k]
        least, least_value, least_confidence = -1, np.inf, 0.0
        for c in range(listed):
            j = columns[c]
            if not _is_judged_on(world, k, j):
                continue
            value, confidence = _agent_psm(world, k, j)
            if trust.agent_psms == ALL_PSMS:
                update_belief(belief, value, confidence, bias, threshold)
            elif value < least_value or (value == least_value and _comes_first(world, k, j, least)):
                least, least_value, least_confidence = j, value, confidence
        if least >= 0:
            update_belief(belief, least_value, least_confidence, bias, threshold)


@kernel
def _is_judged_on(world, k, j):
    """Whether track j makes a PSM for agent k."""
    trust, evidence = world.trust, world.evidence
    if trust.agent_tracks != ALL_TRACKS and trust.track_id[j] < 0:
        return False
    return evidence.expected[k, j] or (trust.held_outside_fov != 0.0 and evidence.held[k, j])


@kernel
def _agent_psm(world, k, j):
    """Value and confidence of what track j says about agent k."""
    belief, held = world.trust.track_belief[j], world.evidence.held[k, j]
    mean, variance = mean_of(belief), variance_of(belief)
    value, weight = mean if held else 1.0 - mean, 1.0 if held else _miss_weight(world, k, j)
    if world.trust.agent_confidence == BY_VARIANCE:
        return value, (1.0 - variance) * weight
    return value, min(0.9999, max(1e-4, weight * (1.0 - 2.0 * math.sqrt(variance))))


@kernel
def _comes_first(world, k, j, other):
    """Of two PSMs of equal value: held tracks before the others, then by track id."""
    held = world.evidence.held[k]
    if held[j] != held[other]:
        return held[j]
    return world.tracks.id[j] < world.tracks.id[other]


@kernel
def _conclude(world, listed):
    """The verdict: means and variances; a track is fit for publication while its trust is at least a half."""
    trust, verdict = world.trust, world.verdict
    for c in range(listed):
        j = world.scratch.listing[c]
        belief = trust.track_belief[j]
        verdict.track_trust[j], verdict.track_trust_var[j] = mean_of(belief), variance_of(belief)
        verdict.publish[j] = verdict.track_trust[j] >= ACCEPT
        trust.track_id[j] = world.tracks.id[j]  # known from now on
    for k in range(trust.agent_belief.shape[0]):
        belief = trust.agent_belief[k]
        verdict.agent_trust[k], verdict.agent_trust_var[k] = mean_of(belief), variance_of(belief)
