"""`trust`: Bayesian trust in tracks and agents (Hallyburton & Pajic 2024, Sec. IV).

Every confirmed track and every agent has a Beta(α, β) belief. A pseudomeasurement (PSM), value v and
confidence c, updates it: α += c v, β += c (1 - v).
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from trust_env.compiled.jit import compiled, inlined
from trust_env.defenses.base import ACCEPT, BuiltIn
from trust_env.defenses.trust_presets import (
    AGENT_TRACKS,
    CONFIDENCES,
    FORGETTING,
    ORDERS,
    PSM_WEIGHTS,
    PSMS,
    check_switches,
)
from trust_env.world.evidence import list_confirmed
from trust_env.world.fields import F, flags1, flags2, floats1, floats2, ints1, ints2, real, shape0

TRACKS_FIRST, ALL_TRACKS, ALL_PSMS, BY_VARIANCE, UNWEIGHTED = 0, 0, 0, 0, 0
DECAY, PRIOR, RETURN = 0, 1, 2
_SWITCHES = [
    "order", "agent_tracks", "agent_psms", "track_forgetting", "agent_forgetting", "agent_confidence",
    "psm_weights", "held_outside_fov", "epsilon", "prior_rate", "dt_return", "agent_negativity_bias",
    "track_negativity_bias", "negativity_threshold", "track_alpha", "track_beta",
]  # fmt: skip
(
    ORDER, TRACKS, PSM_CHOICE, FORGET_TRACKS, FORGET_AGENTS, CONFIDENCE, WEIGHTS, HELD_OUTSIDE,
    EPSILON, RATE, DT_RETURN, AGENT_BIAS, TRACK_BIAS, BIAS_BELOW, TRACK_ALPHA, TRACK_BETA,
) = range(16)  # fmt: skip


class Trust(BuiltIn):
    """Beta trust in tracks and agents.

    `preset` is `paper` (as printed), `cdc2024` (the code that drew the paper's figures) or `mate` (the
    authors' later library); every switch of `trust_env.defenses.switches` can be set alone. Priors are (mean
    φ, precision λ): α = λφ, β = λ(1 - φ).

    agent_prior, track_prior: priors of all agents and of all tracks; agent_priors: {agent index: (φ, λ)};
    trusted, distrusted: agent indices that get the preset's strong prior, mean 0.8 or 0.2. Raises ValueError
    for an unknown switch or value, or a prior outside its range.
    """

    code: ClassVar[int] = 1

    def __init__(self, preset: str = "paper", **switches: Any):
        self._given = {"preset": preset, **switches}
        self.switches = check_switches(preset, switches)

    def params(self) -> dict[str, Any]:
        return dict(self._given)

    def pack(self, n_agents: int) -> tuple[np.ndarray, np.ndarray]:
        s = self.switches
        codes = {
            "order": ORDERS[s["order"]],
            "agent_tracks": AGENT_TRACKS[s["agent_tracks"]],
            "agent_psms": PSMS[s["agent_psms"]],
            "track_forgetting": FORGETTING[s["track_forgetting"]],
            "agent_forgetting": FORGETTING[s["agent_forgetting"]],
            "agent_confidence": CONFIDENCES[s["agent_confidence"]],
            "psm_weights": PSM_WEIGHTS[s["psm_weights"]],
            "track_alpha": s["track_prior"][0] * s["track_prior"][1],
            "track_beta": (1 - s["track_prior"][0]) * s["track_prior"][1],
        }
        values = np.zeros(32)
        values[: len(_SWITCHES)] = [float(codes.get(name, s.get(name) or 0.0)) for name in _SWITCHES]
        return values, self._agent_priors(n_agents)

    def _agent_priors(self, n_agents: int) -> np.ndarray:
        s = self.switches
        priors = dict.fromkeys(range(n_agents), tuple(s["agent_prior"]))
        trusted = dict.fromkeys(s["trusted"], (0.8, s["strong_precision"]))
        distrusted = dict.fromkeys(s["distrusted"], (0.2, s["strong_precision"]))
        for k, prior in {**trusted, **distrusted, **s["agent_priors"]}.items():
            if not 0 <= k < n_agents:
                raise ValueError(
                    f"trust: a prior is given for agent {k}, but the agents are 0 to {n_agents - 1}"
                )
            priors[k] = tuple(prior)
        return np.array([(mean * precision, (1 - mean) * precision) for mean, precision in priors.values()])


# --- kernels ------------------------------------------------------------------------------------------------
# ------------------


@compiled
def reset_trust(world):
    """All beliefs at their priors."""
    belief, prior = floats2(world, F.agent_belief), floats2(world, F.agent_prior)
    for k in range(belief.shape[0]):
        belief[k, 0], belief[k, 1] = prior[k, 0], prior[k, 1]
    for j in range(ints1(world, F.belief_id).shape[0]):
        ints1(world, F.belief_id)[j] = -1


@compiled
def judge_trust(world):
    """One frame: beliefs forget, then take their PSMs, in the order of the preset; then the verdict."""
    switches = floats1(world, F.defense_params)
    listed = list_confirmed(world)
    _forget_tracks(world, listed)
    _forget_agents(world)
    if switches[WEIGHTS] != UNWEIGHTED:
        _count_frames_in_fov(world, listed)
    if switches[ORDER] == TRACKS_FIRST:
        _judge_tracks(world, listed)
        _judge_agents(world, listed)
    else:
        _judge_agents(world, listed)
        _judge_tracks(world, listed)
    _conclude(world, listed)


@inlined
def mean_of(belief):
    """E[τ] = α / (α + β)."""
    return belief[0] / (belief[0] + belief[1])


@inlined
def variance_of(belief):
    """Var[τ] = αβ / ((α + β)² (α + β + 1))."""
    total = belief[0] + belief[1]
    return belief[0] * belief[1] / (total * total * (total + 1.0))


@inlined
def _update(belief, value, confidence, bias, threshold):
    """α += c v, β += c (1 - v); with a negativity bias, α += n/(n+1) c v and β += n²/(n+1) c (1 - v), n =
    bias below the threshold, else 1.
    """
    up, down = 1.0, 1.0
    if bias > 0.0:
        n = bias if value < threshold else 1.0
        up, down = n / (n + 1.0), n * n / (n + 1.0)
    belief[0] += up * confidence * value
    belief[1] += down * confidence * (1.0 - value)


@compiled
def _forget(belief, alpha, beta, rule, switches, dt):
    """Process noise on one belief whose prior is (alpha, beta)."""
    if rule == DECAY:
        precision = belief[0] + belief[1]
        factor = max(alpha + beta, (1.0 - switches[EPSILON]) * precision) / precision
        belief[0] *= factor
        belief[1] *= factor
    elif rule in (PRIOR, RETURN):
        weight = switches[RATE]
        if rule == RETURN:
            weight, alpha, beta = min(1.0, dt / switches[DT_RETURN]), 0.5, 0.5
        belief[0] += weight * (alpha - belief[0])
        belief[1] += weight * (beta - belief[1])


@compiled
def _forget_tracks(world, listed):
    """Known tracks forget; new ones start at the prior, marked by a negative id until they have been
    judged.
    """
    switches, columns, track_id = (
        floats1(world, F.defense_params),
        ints1(world, F.listing),
        ints1(world, F.track_id),
    )
    belief, belief_id, run = (
        floats2(world, F.track_belief),
        ints1(world, F.belief_id),
        ints2(world, F.fov_run),
    )
    for c in range(listed):
        j = columns[c]
        if belief_id[j] == track_id[j]:
            _forget(
                belief[j],
                switches[TRACK_ALPHA],
                switches[TRACK_BETA],
                switches[FORGET_TRACKS],
                switches,
                real(world, F.dt),
            )
        else:
            belief[j, 0], belief[j, 1] = switches[TRACK_ALPHA], switches[TRACK_BETA]
            belief_id[j] = -2 - track_id[j]
            for k in range(run.shape[0]):
                run[k, j] = 0


@compiled
def _forget_agents(world):
    switches, belief, prior = (
        floats1(world, F.defense_params),
        floats2(world, F.agent_belief),
        floats2(world, F.agent_prior),
    )
    for k in range(belief.shape[0]):
        _forget(belief[k], prior[k, 0], prior[k, 1], switches[FORGET_AGENTS], switches, real(world, F.dt))


@compiled
def _count_frames_in_fov(world, listed):
    expected, run, columns = flags2(world, F.expected), ints2(world, F.fov_run), ints1(world, F.listing)
    for k in range(run.shape[0]):
        for c in range(listed):
            run[k, columns[c]] = run[k, columns[c]] + 1 if expected[k, columns[c]] else 0


@compiled
def _miss_weight(world, k, j):
    """w_fov · w_dist · w_age of a negative PSM (the authors' later library); distances in FOV radii, with
    70 m = 1.
    """
    if floats1(world, F.defense_params)[WEIGHTS] == UNWEIGHTED:
        return 1.0
    if ints1(world, F.track_hits)[j] < 2:
        return 0.0
    pose, mean, run = (
        floats2(world, F.pose)[k],
        floats2(world, F.track_mean)[j],
        ints2(world, F.fov_run)[k, j],
    )
    distance = math.hypot(mean[0] - pose[0], mean[1] - pose[1]) / floats1(world, F.fov_radius)[k] * 70.0
    if distance <= 30.0:  # noqa: SIM108 - two rules, one for the near and one for the far
        in_view = 1.0 if run > 2 else 0.25
    else:
        in_view = min(1.0, max(0.0, (run - 3) / 3.0))
    return in_view * (0.5 if distance > 60.0 else 1.0)


@compiled
def _judge_tracks(world, listed):
    """Alg. 1: every agent that is expected to see a track says whether it does; used when at least two are
    expected.
    """
    switches, columns = floats1(world, F.defense_params), ints1(world, F.listing)
    expected, detected = flags2(world, F.expected), flags2(world, F.detected)
    track, agent = floats2(world, F.track_belief), floats2(world, F.agent_belief)
    for c in range(listed):
        j, observers = columns[c], 0
        for k in range(agent.shape[0]):
            observers += expected[k, j]
        if observers >= 2:
            for k in range(agent.shape[0]):
                if expected[k, j]:
                    seen = detected[k, j]
                    confidence = mean_of(agent[k]) * (1.0 if seen else _miss_weight(world, k, j))
                    _update(
                        track[j], 1.0 if seen else 0.0, confidence, switches[TRACK_BIAS], switches[BIAS_BELOW]
                    )


@compiled
def _judge_agents(world, listed):
    """Alg. 2: an agent is as good as the tracks that it holds, and as bad as the good tracks that it does
    not hold.
    """
    switches, columns = floats1(world, F.defense_params), ints1(world, F.listing)
    agent = floats2(world, F.agent_belief)
    bias, threshold = switches[AGENT_BIAS], switches[BIAS_BELOW]
    for k in range(agent.shape[0]):
        least, least_value, least_confidence = -1, np.inf, 0.0
        for c in range(listed):
            j = columns[c]
            if not _is_judged_on(world, k, j):
                continue
            value, confidence = _agent_psm(world, k, j)
            if switches[PSM_CHOICE] == ALL_PSMS:
                _update(agent[k], value, confidence, bias, threshold)
            elif value < least_value or (value == least_value and _comes_first(world, k, j, least)):
                least, least_value, least_confidence = j, value, confidence
        if least >= 0:
            _update(agent[k], least_value, least_confidence, bias, threshold)


@compiled
def _is_judged_on(world, k, j):
    """Whether track j makes a PSM for agent k."""
    switches = floats1(world, F.defense_params)
    if switches[TRACKS] != ALL_TRACKS and ints1(world, F.belief_id)[j] < 0:
        return False
    return flags2(world, F.expected)[k, j] or (switches[HELD_OUTSIDE] != 0.0 and flags2(world, F.held)[k, j])


@compiled
def _agent_psm(world, k, j):
    """Value and confidence of what track j says about agent k."""
    belief, switches = floats2(world, F.track_belief)[j], floats1(world, F.defense_params)
    mean, variance, held = mean_of(belief), variance_of(belief), flags2(world, F.held)[k, j]
    value = mean if held else 1.0 - mean
    if switches[CONFIDENCE] == BY_VARIANCE:
        return value, (1.0 - variance) * (1.0 if held else _miss_weight(world, k, j))
    weight = 1.0 if held else _miss_weight(world, k, j)
    return value, min(0.9999, max(1e-4, weight * (1.0 - 2.0 * math.sqrt(variance))))


@compiled
def _comes_first(world, k, j, other):
    """Of two PSMs of equal value: held tracks before the others, then by track id."""
    held, track_id = flags2(world, F.held)[k], ints1(world, F.track_id)
    if held[j] != held[other]:
        return held[j]
    return track_id[j] < track_id[other]


@compiled
def _conclude(world, listed):
    """The verdict: means and variances; a track is fit for publication while its trust is at least a half."""
    columns, publish = ints1(world, F.listing), flags1(world, F.publish)
    track, agent = floats2(world, F.track_belief), floats2(world, F.agent_belief)
    for c in range(listed):
        j = columns[c]
        floats1(world, F.track_trust)[j], floats1(world, F.track_trust_var)[j] = (
            mean_of(track[j]),
            variance_of(track[j]),
        )
        publish[j] = mean_of(track[j]) >= ACCEPT
        ints1(world, F.belief_id)[j] = ints1(world, F.track_id)[j]  # known from now on
    for k in range(shape0(world, F.agent_belief)):
        floats1(world, F.agent_trust)[k], floats1(world, F.agent_trust_var)[k] = (
            mean_of(agent[k]),
            variance_of(agent[k]),
        )
