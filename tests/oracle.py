"""A plain, slow reference of the fusion centre: tracker, evidence and trust in NumPy and SciPy.

Written from the publications, not from the compiled kernels, so that the two can disagree. Every loop is a
Python loop over tracks, agents and detections; nothing is batched or cached. Sources: Hallyburton & Pajic
2024, "Bayesian Methods for Trust in Collaborative Multi-Agent Autonomy" (the paper), Secs. III and IV;
Sittler 1964 and Blackman 1986 for the track score.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.stats import chi2

Contains = Callable[[np.ndarray], bool]  # Φ_k(point[2]) -> bool
H = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]])  # position out of [x, y, vx, vy]


# --- Fields of view -----------------------------------------------------------------------------------------


def circle(position: Sequence[float], radius: float) -> Contains:
    return lambda point: math.hypot(point[0] - position[0], point[1] - position[1]) <= radius


def sector(position: Sequence[float], radius: float, heading: float, width: float) -> Contains:
    """`width` is the total opening, `heading` its middle, both in radians of the world frame."""

    def contains(point: np.ndarray) -> bool:
        dx, dy = point[0] - position[0], point[1] - position[1]
        off = math.remainder(math.atan2(dy, dx) - heading, 2.0 * math.pi)
        return math.hypot(dx, dy) <= radius and abs(off) <= 0.5 * width

    return contains


def polygon(vertices: np.ndarray) -> Contains:
    """Convex, in the world frame, either orientation: all edges have the point on the same side."""

    def contains(point: np.ndarray) -> bool:
        edge = np.roll(vertices, -1, axis=0) - vertices
        to_point = np.asarray(point) - vertices
        side = edge[:, 0] * to_point[:, 1] - edge[:, 1] * to_point[:, 0]
        return bool(np.all(side >= 0.0) or np.all(side <= 0.0))

    return contains


# --- Assignment ---------------------------------------------------------------------------------------------


def assign(allowed: np.ndarray, cost: np.ndarray) -> list[tuple[int, int]]:
    """One-to-one pairs (row, column): most allowed pairs first, then the least sum of costs.

    Costs are shifted to [0, C]; an allowed pair earns a bonus of (n + 1)(C + 1), more than any n pairs cost.
    """
    if not allowed.any():
        return []
    shifted = np.where(allowed, cost - cost[allowed].min(), 0.0)
    bonus = (min(allowed.shape) + 1) * (shifted.max() + 1.0)
    rows, columns = linear_sum_assignment(np.where(allowed, shifted - bonus, 0.0))
    return [(int(r), int(c)) for r, c in zip(rows, columns, strict=True) if allowed[r, c]]


# --- Tracker ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TrackerParams:
    p_detect: float = 0.9
    beta_fp: float = 1e-6  # 1/m²
    beta_nt: float = 1e-9  # 1/m²
    process_noise: float = 1e-6  # m²/s³
    initial_velocity_variance: float = 1e-4  # (m/s)²
    gate: float = 0.99  # probability
    alpha: float = 1e-4
    beta: float = 1e-2
    confirmation: str = "score"  # score | m_of_n | score_or_hits
    confirm_m: int = 3
    confirm_n: int = 5
    confirm_hits: int = 3
    deletion: str = "drop"  # drop | relative | absolute
    confirmed_drop: float = 10.0  # nats
    tentative_drop: float = 4.5  # nats
    max_unseen: int = 5  # frames
    capacity: int = 64


@dataclass
class OracleTrack:
    id: int
    mean: np.ndarray  # [4], m and m/s
    cov: np.ndarray  # [4, 4]
    score: float  # L, nats
    birth_score: float  # L_0, nats
    confirmed: bool = False
    peak: float = -math.inf  # largest score at the end of a frame
    age: int = 0  # frames since birth, 1 at the end of the first
    hits: int = 1  # detections that hit it, the one it was born from included
    hit_this_frame: bool = True
    recent: deque[bool] = field(default_factory=deque)  # hit in each of the last frames
    unseen: int = 0  # frames in a row in which no FOV contained it and nothing hit it
    contributed: dict[int, float] = field(default_factory=dict)  # agent -> nats it has added to the score

    @property
    def status(self) -> str:
        return "confirmed" if self.confirmed else "tentative"

    @property
    def position(self) -> np.ndarray:
        return self.mean[:2]


class OracleTracker:
    """Constant-velocity Kalman filter, agent-by-agent nearest neighbour, track score (paper, Eqs. 4-7)."""

    def __init__(self, params: TrackerParams) -> None:
        self.params = params
        self.tracks: list[OracleTrack] = []  # ascending id
        self.next_id = 0
        self.evicted = 0  # tentative tracks that gave way in a full store
        self.dropped = 0  # births that found the store full of confirmed tracks
        self.hits: list[tuple[int, int, int]] = []  # (agent, track id, detection) of this frame
        self.assignment: list[np.ndarray] = []  # per agent, [n_k] track id or -1

    @property
    def confirmed(self) -> list[OracleTrack]:
        return [track for track in self.tracks if track.confirmed]

    def update(
        self,
        detections: Sequence[np.ndarray],  # per agent [n_k, 2], m
        contains: Sequence[Contains],
        noise_cov: Sequence[np.ndarray],  # per agent R_k[2, 2], m²
        dt: float,
        p_detect: Sequence[float] | None = None,
        beta_fp: Sequence[float] | None = None,
        beta_nt: Sequence[float] | None = None,
        weights: Sequence[float] | None = None,
    ) -> list[OracleTrack]:
        n_agents = len(detections)
        p_detect = [self.params.p_detect] * n_agents if p_detect is None else p_detect
        beta_fp = [self.params.beta_fp] * n_agents if beta_fp is None else beta_fp
        beta_nt = [self.params.beta_nt] * n_agents if beta_nt is None else beta_nt
        weights = [1.0] * n_agents if weights is None else weights
        heeded = [k for k in range(n_agents) if weights[k] >= 1e-3]
        self.hits = []
        self.assignment = [np.full(len(detections[k]), -1) for k in range(n_agents)]
        self.predict(dt)
        for k in heeded:
            scan = np.asarray(detections[k], dtype=float).reshape(-1, 2)
            looked_at = [track.id for track in self.tracks if contains[k](track.position)]
            cov = np.asarray(noise_cov[k], dtype=float) / weights[k]
            hit = self.associate(k, scan, self.tracks, cov)  # a track just outside Φ_k can be hit, not missed
            for track in self.tracks:
                if track.id in hit:
                    self.hit(track, k, scan[hit[track.id]], cov, p_detect[k], beta_fp[k], weights[k])
                elif track.id in looked_at:
                    self.add_score(track, k, weights[k] * math.log(1.0 - p_detect[k]))
            birth_score = math.log(p_detect[k] * beta_nt[k] / beta_fp[k])
            for i in sorted(set(range(len(scan))) - set(hit.values())):
                self.assignment[k][i] = self.give_birth(k, scan[i], cov, birth_score)
        self.end_frame([contains[k] for k in heeded])
        return self.tracks

    def predict(self, dt: float) -> None:
        transition = np.array([[1, 0, dt, 0], [0, 1, 0, dt], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=float)
        a, b, c = dt**3 / 3, dt**2 / 2, dt
        noise = np.array([[a, 0, b, 0], [0, a, 0, b], [b, 0, c, 0], [0, b, 0, c]]) * self.params.process_noise
        for track in self.tracks:
            track.mean = transition @ track.mean
            track.cov = transition @ track.cov @ transition.T + noise
            track.hit_this_frame = False

    def associate(
        self, agent: int, scan: np.ndarray, tracks: list[OracleTrack], noise_cov: np.ndarray
    ) -> dict[int, int]:
        """Track id -> detection: within the gate, most pairs, then the least sum of d² + ln|S|."""
        threshold = gate_threshold(self.params.gate)
        allowed = np.zeros((len(tracks), len(scan)), dtype=bool)
        cost = np.zeros((len(tracks), len(scan)))
        for row, track in enumerate(tracks):
            innovation_cov = H @ track.cov @ H.T + noise_cov
            d2 = mahalanobis2(scan - track.position, innovation_cov)
            allowed[row] = d2 <= threshold
            cost[row] = d2 + math.log(np.linalg.det(innovation_cov))
        pairs = assign(allowed, cost)
        for row, column in pairs:
            self.assignment[agent][column] = tracks[row].id
            self.hits.append((agent, tracks[row].id, column))
        return {tracks[row].id: column for row, column in pairs}

    def hit(
        self,
        track: OracleTrack,
        agent: int,
        detection: np.ndarray,
        noise_cov: np.ndarray,
        p_detect: float,
        beta_fp: float,
        weight: float,
    ) -> None:
        """ΔL = ln(P_D / (2π β_FP sqrt|S|)) - d²/2 with the predicted state; then the Kalman update."""
        innovation = detection - track.position
        innovation_cov = H @ track.cov @ H.T + noise_cov
        likelihood_ratio = p_detect / (2 * math.pi * beta_fp * math.sqrt(np.linalg.det(innovation_cov)))
        d2 = float(mahalanobis2(innovation, innovation_cov))
        self.add_score(track, agent, weight * (math.log(likelihood_ratio) - d2 / 2))
        gain = track.cov @ H.T @ np.linalg.inv(innovation_cov)
        rest = np.eye(4) - gain @ H
        track.mean = track.mean + gain @ innovation
        track.cov = rest @ track.cov @ rest.T + gain @ noise_cov @ gain.T  # Joseph form
        track.hits += 1
        track.hit_this_frame = True

    def add_score(self, track: OracleTrack, agent: int, change: float) -> None:
        track.score += change
        track.contributed[agent] = track.contributed.get(agent, 0.0) + change

    def give_birth(self, agent: int, detection: np.ndarray, noise_cov: np.ndarray, score: float) -> int:
        """A track at rest; in a full store the lowest-scored tentative one (or the older) gives way."""
        if len(self.tracks) >= self.params.capacity:
            tentative = [track for track in self.tracks if not track.confirmed]
            if not tentative:
                self.dropped += 1
                return -1
            self.evicted += 1
            self.tracks.remove(min(tentative, key=lambda track: (track.score, track.id)))
        cov = np.zeros((4, 4))
        cov[:2, :2] = noise_cov
        cov[2:, 2:] = self.params.initial_velocity_variance * np.eye(2)
        mean = np.array([detection[0], detection[1], 0.0, 0.0])
        born = OracleTrack(self.next_id, mean, cov, score, score, contributed={agent: score})
        self.tracks.append(born)
        self.next_id += 1
        return born.id

    def end_frame(self, contains: Sequence[Contains]) -> None:
        """First confirm, for good, then delete."""
        for track in self.tracks:
            seen = track.hit_this_frame or any(contains_k(track.position) for contains_k in contains)
            track.unseen = 0 if seen else track.unseen + 1
            track.recent.append(track.hit_this_frame)
            while len(track.recent) > self.params.confirm_n:
                track.recent.popleft()
            track.age += 1
            track.peak = max(track.peak, track.score)
            track.confirmed = track.confirmed or self.confirms(track)
        self.tracks = [track for track in self.tracks if not self.deletes(track)]

    def confirms(self, track: OracleTrack) -> bool:
        enough_score = track.score >= math.log((1.0 - self.params.beta) / self.params.alpha)  # T_2
        if self.params.confirmation == "score":
            return enough_score
        if self.params.confirmation == "m_of_n":
            return sum(track.recent) >= self.params.confirm_m
        if self.params.confirmation == "score_or_hits":
            return enough_score or track.hits >= self.params.confirm_hits
        raise ValueError(self.params.confirmation)

    def deletes(self, track: OracleTrack) -> bool:
        if track.unseen >= self.params.max_unseen:
            return True
        lowest = math.log(self.params.beta / (1.0 - self.params.alpha))  # T_1
        if self.params.deletion == "drop":
            drop = self.params.confirmed_drop if track.confirmed else self.params.tentative_drop
            return track.score < track.peak - drop
        if self.params.deletion == "relative":
            return track.score - track.birth_score < lowest
        if self.params.deletion == "absolute":
            return track.score < lowest
        raise ValueError(self.params.deletion)


@cache
def gate_threshold(gate: float) -> float:
    """Largest d² inside the gate: the chi-square quantile for two dimensions."""
    return float(chi2.ppf(gate, 2))


def mahalanobis2(innovation: np.ndarray, innovation_cov: np.ndarray) -> np.ndarray:
    """d² = νᵀ S⁻¹ ν, for one innovation [2] or for several [n, 2]."""
    return np.sum(innovation * np.linalg.solve(innovation_cov, innovation.T).T, axis=-1)


# --- Evidence -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class OracleEvidence:
    """What one frame tells about the confirmed central tracks, in ascending order of their ids."""

    track_id: np.ndarray  # [J]
    expected: np.ndarray  # [K, J], Φ_k contains the track after all updates
    detected: np.ndarray  # [K, J], k reported a detection near it
    held: np.ndarray  # [K, J], k's own tracker has confirmed it too
    # Only the "mate" preset weighs these.
    distance: np.ndarray | None = None  # [K, J], as a fraction of the radius of k's FOV
    hits: np.ndarray | None = None  # [J], detections that hit the track
    in_a_row: np.ndarray | None = None  # [K, J], frames in a row, this one included, in which k was expected


def oracle_evidence(
    tracks: Sequence[OracleTrack],
    reports: Sequence[np.ndarray],
    local_tracks: Sequence[Sequence[OracleTrack]],
    contains: Sequence[Contains],
    noise_cov: Sequence[np.ndarray],
    *,
    gate: float = 0.99,
    near_distance: float | None = None,
    hold_distance: float,
) -> OracleEvidence:
    """Evidence about `tracks` (the confirmed ones) from all that the agents reported and track themselves."""
    shape = (len(reports), len(tracks))
    expected, detected, held = (np.zeros(shape, dtype=bool) for _ in range(3))
    threshold = gate_threshold(gate)
    for k, report in enumerate(reports):
        for j, track in enumerate(tracks):
            expected[k, j] = contains[k](track.position)
            offset = np.asarray(report, dtype=float).reshape(-1, 2) - track.position
            near = mahalanobis2(offset, H @ track.cov @ H.T + noise_cov[k]) <= threshold
            if near_distance is not None:
                near = near | (np.hypot(offset[:, 0], offset[:, 1]) <= near_distance)
            detected[k, j] = near.any()
        for j in held_by(tracks, local_tracks[k], hold_distance):
            held[k, j] = True
    ids = np.array([track.id for track in tracks], dtype=int)
    return OracleEvidence(ids, expected, detected, held, hits=np.array([track.hits for track in tracks]))


def held_by(tracks: Sequence[OracleTrack], local: Sequence[OracleTrack], hold_distance: float) -> list[int]:
    """Indices of `tracks` that find a partner among the confirmed `local` ones within the distance."""
    partners = [track for track in local if track.confirmed]
    distance = np.zeros((len(tracks), len(partners)))
    for row, track in enumerate(tracks):
        for column, partner in enumerate(partners):
            distance[row, column] = math.hypot(*(track.position - partner.position))
    return [row for row, _ in assign(distance <= hold_distance, distance)]


# --- Trust --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TrustSwitches:
    order: str = "tracks_agents"  # tracks_agents | agents_tracks
    known_only: bool = False  # judge agents only on tracks of the previous frame
    held_outside: bool = False  # a track that an agent holds counts although its FOV does not contain it
    agent_psms: str = "all"  # all | least
    forgetting: str = "precision"  # precision | to_prior | return
    epsilon: float = 0.01  # precision: λ <- max(λ_prior, (1 - ε) λ)
    to_prior: float = 0.2  # to_prior: tracks only
    dt_return: float = 10.0  # return: s
    confidence: str = "variance"  # variance: 1 - Var | deviation: clip(w (1 - 2 std))
    negativity_bias: float = 0.0  # 0 = none
    negativity_threshold: float = 0.4
    weigh_negatives: bool = False  # w of a negative pseudomeasurement


PRESETS = {
    "paper": TrustSwitches(),
    "cdc2024": TrustSwitches(
        order="agents_tracks", known_only=True, held_outside=True, agent_psms="least", forgetting="to_prior"
    ),
    "mate": TrustSwitches(
        order="agents_tracks",
        held_outside=True,
        forgetting="return",
        confidence="deviation",
        negativity_bias=4.0,
        weigh_negatives=True,
    ),
}


@dataclass
class Belief:
    """Beta(a, b)."""

    a: float
    b: float

    @classmethod
    def of(cls, mean: float, precision: float) -> Belief:
        return cls(precision * mean, precision * (1.0 - mean))

    @property
    def mean(self) -> float:
        return self.a / (self.a + self.b)

    @property
    def variance(self) -> float:
        total = self.a + self.b
        return self.a * self.b / (total**2 * (total + 1.0))

    def move_toward(self, a: float, b: float, share: float) -> None:
        self.a, self.b = (1.0 - share) * self.a + share * a, (1.0 - share) * self.b + share * b

    def scale_to(self, precision: float) -> None:
        self.a, self.b = precision * self.mean, precision * (1.0 - self.mean)


class OracleTrust:
    """Beta beliefs in tracks and agents from pseudomeasurements (paper, Algs. 1 and 2)."""

    def __init__(
        self,
        preset: str = "paper",
        *,
        n_agents: int,
        agent_priors: Mapping[int, tuple[float, float]] | None = None,  # agent -> (mean, precision)
        agent_prior: tuple[float, float] = (0.5, 1.0),
        track_prior: tuple[float, float] = (0.5, 1.0),
        dt: float = 0.1,
        **switches: object,
    ) -> None:
        self.switches = replace(PRESETS[preset], **switches)  # type: ignore[arg-type]
        self.dt = dt
        self.agent_priors = [(agent_priors or {}).get(k, agent_prior) for k in range(n_agents)]
        self.track_prior = track_prior
        self.agents = [Belief.of(*prior) for prior in self.agent_priors]
        self.tracks: dict[int, Belief] = {}
        self.known: set[int] = set()  # tracks of the previous frame
        self.agent_psms: list[list[tuple[float, float]]] = []  # applied in the last frame

    def update(self, evidence: OracleEvidence) -> None:
        ids = [int(i) for i in evidence.track_id]
        self.known = set(self.tracks) & set(ids)
        self.tracks = {i: self.tracks.get(i, Belief.of(*self.track_prior)) for i in ids}
        self.forget()
        if self.switches.order == "tracks_agents":
            self.judge_tracks(evidence)
            self.judge_agents(evidence)
        else:
            self.judge_agents(evidence)
            self.judge_tracks(evidence)

    @property
    def track_beliefs(self) -> dict[int, tuple[float, float]]:
        return {i: (belief.a, belief.b) for i, belief in self.tracks.items()}

    @property
    def agent_beliefs(self) -> list[tuple[float, float]]:
        return [(belief.a, belief.b) for belief in self.agents]

    def forget(self) -> None:
        if self.switches.forgetting == "precision":
            for belief, (_, least) in self.with_priors():
                belief.scale_to(max(least, (1.0 - self.switches.epsilon) * (belief.a + belief.b)))
        elif self.switches.forgetting == "to_prior":
            prior = Belief.of(*self.track_prior)
            for i in self.known:
                self.tracks[i].move_toward(prior.a, prior.b, self.switches.to_prior)
        elif self.switches.forgetting == "return":
            share = min(1.0, self.dt / self.switches.dt_return)
            for belief in self.agents + [self.tracks[i] for i in self.known]:
                belief.move_toward(0.5, 0.5, share)
        else:
            raise ValueError(self.switches.forgetting)

    def with_priors(self) -> list[tuple[Belief, tuple[float, float]]]:
        agents = list(zip(self.agents, self.agent_priors, strict=True))
        return agents + [(self.tracks[i], self.track_prior) for i in self.known]

    def judge_tracks(self, evidence: OracleEvidence) -> None:
        """Alg. 1: v = 1 if k has a detection near track j else 0, c = E[τ_k]; from two expected agents on."""
        for j, i in enumerate(self.tracks):
            expected = [k for k in range(len(self.agents)) if evidence.expected[k, j]]
            if len(expected) < 2:
                continue
            for k in expected:
                seen = bool(evidence.detected[k, j])
                weight = 1.0 if seen else self.weight(evidence, k, j)
                if weight is not None:
                    confidence = weight * self.agents[k].mean
                    self.tracks[i].a += confidence * seen
                    self.tracks[i].b += confidence * (not seen)

    def judge_agents(self, evidence: OracleEvidence) -> None:
        """Alg. 2: v = E[τ_j] if k's own tracks hold track j, else 1 - E[τ_j] if k is expected to see it."""
        self.agent_psms = [self.psms_of_agent(evidence, k) for k in range(len(self.agents))]
        for belief, psms in zip(self.agents, self.agent_psms, strict=True):
            for value, confidence in psms:
                self.add_to_agent(belief, value, confidence)

    def psms_of_agent(self, evidence: OracleEvidence, k: int) -> list[tuple[float, float]]:
        held, missed = [], []
        for j, (i, belief) in enumerate(self.tracks.items()):
            if self.switches.known_only and i not in self.known:
                continue
            if evidence.held[k, j] and (evidence.expected[k, j] or self.switches.held_outside):
                held.append((belief.mean, self.confidence(belief, 1.0)))
            elif evidence.expected[k, j]:
                weight = self.weight(evidence, k, j)
                if weight is not None:
                    missed.append((1.0 - belief.mean, self.confidence(belief, weight)))
        psms = held + missed
        if self.switches.agent_psms == "least" and psms:
            return [min(psms, key=lambda psm: psm[0])]  # min() returns the first of equals
        return psms

    def confidence(self, track: Belief, weight: float) -> float:
        if self.switches.confidence == "variance":
            return weight * (1.0 - track.variance)
        return min(max(weight * (1.0 - 2.0 * math.sqrt(track.variance)), 1e-4), 0.9999)

    def add_to_agent(self, agent: Belief, value: float, confidence: float) -> None:
        bias = self.switches.negativity_bias
        if not bias:
            agent.a += confidence * value
            agent.b += confidence * (1.0 - value)
            return
        n = bias if value < self.switches.negativity_threshold else 1.0
        agent.a += n / (n + 1.0) * confidence * value
        agent.b += n**2 / (n + 1.0) * confidence * (1.0 - value)

    def weight(self, evidence: OracleEvidence, k: int, j: int) -> float | None:
        """w = w_fov w_dist w_age of a negative pseudomeasurement; None where there is none at all."""
        if not self.switches.weigh_negatives:
            return 1.0
        assert evidence.distance is not None and evidence.hits is not None and evidence.in_a_row is not None
        metres = 70.0 * float(evidence.distance[k, j])  # the authors' FOV has 70 m
        frames = int(evidence.in_a_row[k, j])
        if metres > 70.0:
            return None
        w_age = 0.0 if evidence.hits[j] < 2 else 1.0
        w_dist = 0.5 if metres > 60.0 else 1.0
        near = 1.0 if frames > 2 else 0.25
        w_fov = near if metres <= 30.0 else min(max((frames - 3) / 3.0, 0.0), 1.0)
        return w_fov * w_dist * w_age


# --- A whole centre -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class OracleFrame:
    tracks: list[OracleTrack]  # all central tracks, ascending id
    evidence: OracleEvidence  # about the confirmed ones
    track_beliefs: dict[int, tuple[float, float]]
    agent_beliefs: list[tuple[float, float]]


class OracleCentre:
    """Every agent's local tracker, the central tracker, the evidence and trust: one `update` is one frame."""

    def __init__(
        self,
        params: TrackerParams,
        trust: OracleTrust,
        *,
        hold_distance: float,
        near_distance: float | None = None,
        local_capacity: int = 32,
    ) -> None:
        self.params, self.trust = params, trust
        self.hold_distance, self.near_distance = hold_distance, near_distance
        self.central = OracleTracker(params)
        local = replace(params, capacity=local_capacity)
        self.local = [OracleTracker(local) for _ in trust.agents]
        self.in_a_row: dict[tuple[int, int], int] = {}  # (agent, track id) -> frames, from the track's birth on

    def update(
        self,
        detections: Sequence[np.ndarray],
        contains: Sequence[Contains],
        noise_cov: Sequence[np.ndarray],
        dt: float,
        *,
        p_detect: Sequence[float] | None = None,
        beta_fp: Sequence[float] | None = None,
        beta_nt: Sequence[float] | None = None,
        weights: Sequence[float] | None = None,
        positions: Sequence[Sequence[float]] | None = None,
        radius: Sequence[float] | None = None,
    ) -> OracleFrame:
        beliefs = {"p_detect": p_detect, "beta_fp": beta_fp, "beta_nt": beta_nt}
        for k, tracker in enumerate(self.local):
            own = {name: None if values is None else [values[k]] for name, values in beliefs.items()}
            tracker.update([detections[k]], [contains[k]], [noise_cov[k]], dt, **own)
        self.central.update(detections, contains, noise_cov, dt, weights=weights, **beliefs)
        evidence = oracle_evidence(
            self.central.confirmed,
            detections,
            [tracker.tracks for tracker in self.local],
            contains,
            noise_cov,
            gate=self.params.gate,
            near_distance=self.near_distance,
            hold_distance=self.hold_distance,
        )
        evidence = self.with_view(evidence, contains, positions, radius)
        self.trust.dt = dt
        self.trust.update(evidence)
        beliefs_now = self.trust.track_beliefs, self.trust.agent_beliefs
        return OracleFrame(self.central.tracks, evidence, *beliefs_now)

    def with_view(
        self,
        evidence: OracleEvidence,
        contains: Sequence[Contains],
        positions: Sequence[Sequence[float]] | None,
        radius: Sequence[float] | None,
    ) -> OracleEvidence:
        """Adds how far each track is from each agent, and for how many frames in a row it was in view."""
        agents = range(len(contains))
        self.in_a_row = {
            (k, track.id): self.in_a_row.get((k, track.id), 0) + 1
            for track in self.central.tracks
            for k in agents
            if contains[k](track.position)
        }
        in_a_row = np.zeros(evidence.expected.shape, dtype=int)
        distance = np.zeros(evidence.expected.shape)
        for j, track in enumerate(self.central.confirmed):
            for k in agents:
                in_a_row[k, j] = self.in_a_row.get((k, track.id), 0)
                if positions is not None and radius is not None:
                    distance[k, j] = math.hypot(*(track.position - np.asarray(positions[k]))) / radius[k]
        return replace(evidence, distance=distance, in_a_row=in_a_row)
