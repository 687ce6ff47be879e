"""How many frames false positives need to be confirmed: the track-score theory as plain functions.

Source: Hallyburton & Pajic 2024, "Bayesian Methods for Trust in Collaborative Multi-Agent Autonomy" (CDC),
Sec. III, with the track score of Sittler 1964 and Blackman 1986 (paper, Eqs. 4-7). Scores are natural-log
likelihood ratios.

| argument  | symbol | meaning                                                                  |
| --------- | ------ | ------------------------------------------------------------------------ |
| p_detect  | P_D    | probability that an agent detects a target inside its FOV, 0 < P_D < 1   |
| beta_fp   | β_FP   | density of natural false positives, per unit volume of measurement space |
| beta_nt   | β_NT   | density of new targets, per unit volume of measurement space             |
| det_r     | det R  | determinant of the measurement noise covariance                          |
| eta       | η      | dimension of a measurement                                               |
| alpha     | α      | probability that a false track is confirmed (Wald's test)                |
| beta      | β      | probability that a true track is deleted (Wald's test)                   |
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Matrix = NDArray[np.floating]

_CONVERGED = 1e-13  # a frame that changes the covariance by less, relative to the predicted one, is steady


class ScoreThresholds(NamedTuple):
    """Thresholds of the track score L: delete at L < T_1, confirm at L >= T_2 (paper, Eq. 7)."""

    delete: float  # T_1, nats
    confirm: float  # T_2, nats


def score_thresholds(*, alpha: float = 1e-4, beta: float = 1e-2) -> ScoreThresholds:
    """Wald's thresholds `(T_1, T_2)`: T_1 = ln(β / (1 - α)), T_2 = ln((1 - β) / α) (paper, Eq. 7)."""
    _require("alpha", alpha, 0.0 < alpha < 1.0, "a probability in (0, 1)")
    _require("beta", beta, 0.0 < beta < 1.0, "a probability in (0, 1)")
    return ScoreThresholds(delete=math.log(beta / (1.0 - alpha)), confirm=math.log((1.0 - beta) / alpha))


def initial_score(*, p_detect: float = 0.9, beta_fp: float = 1e-6, beta_nt: float = 1e-9) -> float:
    """Score of a track at birth, L_0 = ln(P_D β_NT / β_FP) in nats (paper, Eq. 5)."""
    _require("p_detect", p_detect, 0.0 < p_detect < 1.0, "a probability in (0, 1)")
    _require_positive(beta_fp=beta_fp, beta_nt=beta_nt)
    return math.log(p_detect * beta_nt / beta_fp)


def max_hit_gain(*, p_detect: float = 0.9, beta_fp: float = 1e-6, det_r: float = 5.0, eta: int = 2) -> float:
    """Most that one hit can add to a score, in nats (paper, Prop. 1).

    g = ln( P_D / ((2π)^(η/2) β_FP sqrt(det R)) ): the hit's ΔL at d² = 0 with the smallest innovation
    covariance there is, S = R. The filter's own S is larger, so this is a supremum.
    """
    _require("p_detect", p_detect, 0.0 < p_detect < 1.0, "a probability in (0, 1)")
    _require("eta", eta, eta >= 1, "a dimension of at least 1")
    _require_positive(beta_fp=beta_fp, det_r=det_r)
    return math.log(p_detect / beta_fp) - 0.5 * eta * math.log(2.0 * math.pi) - 0.5 * math.log(det_r)


def max_score_change(
    n_adversaries: int,
    n_benign: int,
    *,
    p_detect: float = 0.9,
    beta_fp: float = 1e-6,
    det_r: float = 5.0,
    eta: int = 2,
) -> float:
    """Most that one frame can add to the score of a false positive, in nats (paper, Prop. 2).

    ΔL_max = K_a g + K_b ln(1 - P_D): all K_a adversaries hit, all K_b benign agents that see the place miss.
    """
    _require_count(n_adversaries=n_adversaries, n_benign=n_benign)
    gain = max_hit_gain(p_detect=p_detect, beta_fp=beta_fp, det_r=det_r, eta=eta)
    return n_adversaries * gain + n_benign * math.log1p(-p_detect)


def gate_volume(gate: float, innovation_cov: ArrayLike) -> float:
    """Volume of the gate, the ellipsoid d² <= G, in units of the measurement space (paper, Prop. 3).

    V_G = π^(η/2) / Γ(η/2 + 1) · G^(η/2) · sqrt(det S), which is π G sqrt(det S) for η = 2.

    gate            below 1: probability that a target's own detection falls inside, from which G follows as
                    the chi-square quantile (as the tracker's `gate`); from 1 on: the threshold G itself
    innovation_cov  S[η, η]
    """
    cov = _covariance("innovation_cov", innovation_cov)
    _require("gate", gate, 0.0 < gate < math.inf, "a probability in (0, 1), or a threshold on d²")
    eta = cov.shape[0]
    threshold = gate if gate >= 1.0 else _chi_square_quantile(gate, eta)
    unit_ball = math.pi ** (0.5 * eta) / math.gamma(0.5 * eta + 1.0)
    return unit_ball * threshold ** (0.5 * eta) * math.sqrt(np.linalg.det(cov))


def gate_false_positive_probability(gate_volume: float, beta_fp: float = 1e-6) -> float:
    """Probability that at least one natural false positive falls into a gate in one frame (paper, Prop. 3).

    P = 1 - exp(-β_FP V_G), for Poisson clutter of density β_FP, of one agent.
    """
    _require("gate_volume", gate_volume, 0.0 <= gate_volume < math.inf, "a volume of at least 0")
    _require("beta_fp", beta_fp, 0.0 <= beta_fp < math.inf, "a density of at least 0")
    return -math.expm1(-beta_fp * gate_volume)


def frames_to_confirm(
    n_adversaries: int,
    n_benign: int,
    *,
    p_detect: float = 0.9,
    beta_fp: float = 1e-6,
    beta_nt: float = 1e-9,
    det_r: float = 5.0,
    eta: int = 2,
    alpha: float = 1e-4,
    beta: float = 1e-2,
) -> float:
    """Fewest frames in which a false positive can be confirmed (paper, Thm. 1); a real number, or infinity.

    T_min = 1 + (T_2 - L_0) / (K_a g + K_b ln(1 - P_D)): the first frame contributes L_0 alone, every later
    one `max_score_change`. Infinity where that change is not positive. The paper's figure was drawn with
    α = 1e-4 and η = 3 (its caption says 1e-6).
    """
    change = max_score_change(
        n_adversaries, n_benign, p_detect=p_detect, beta_fp=beta_fp, det_r=det_r, eta=eta
    )
    missing = _missing_score(p_detect=p_detect, beta_fp=beta_fp, beta_nt=beta_nt, alpha=alpha, beta=beta)
    return 1.0 + max(0.0, missing) / change if change > 0.0 else math.inf


def sequential_frames_to_confirm(
    n_adversaries: int,
    n_benign: int,
    *,
    p_detect: float = 0.9,
    beta_fp: float = 1e-6,
    beta_nt: float = 1e-9,
    det_r: float = 5.0,
    eta: int = 2,
    alpha: float = 1e-4,
    beta: float = 1e-2,
) -> float:
    """Theorem 1 for a centre that takes the agents one after another: a lower bound that no attack beats.

    T_seq = 1 + max(0, T_2 - L_0 - (K_a - 1) g) / (K_a g + K_b ln(1 - P_D)), which is T_min for K_a = 1: the
    other K_a - 1 adversaries hit the newborn track in its first frame already. No false positive is confirmed
    before frame ceil(T_seq), frames counted from 1, while its track lies inside every benign FOV. Infinity
    where the first frame does not suffice and no later one can add to the score.
    """
    change = max_score_change(
        n_adversaries, n_benign, p_detect=p_detect, beta_fp=beta_fp, det_r=det_r, eta=eta
    )
    gain = max_hit_gain(p_detect=p_detect, beta_fp=beta_fp, det_r=det_r, eta=eta)
    missing = _missing_score(p_detect=p_detect, beta_fp=beta_fp, beta_nt=beta_nt, alpha=alpha, beta=beta)
    missing -= (n_adversaries - 1) * gain
    if n_adversaries > 0 and missing <= 0.0:
        return 1.0
    return 1.0 + missing / change if change > 0.0 else math.inf


def score_optimal_frames(
    order: Iterable[str],
    *,
    p_detect: float = 0.9,
    beta_fp: float = 1e-6,
    beta_nt: float = 1e-9,
    alpha: float = 1e-4,
    beta: float = 1e-2,
    noise_cov: ArrayLike | None = None,
    initial_velocity_variance: float = 1e-4,
    process_noise: float = 1e-6,
    dt: float = 0.1,
    tentative_drop: float = 4.5,
) -> float:
    """Frame, from 1, in which a score-optimal false positive is confirmed, given the order, or infinity.

    Runs the score recursion with the filter's own innovation covariance S: every adversary hits with d² = 0,
    every benign agent misses, one after another. The first adversary starts the track, so benign agents
    before it count from the second frame on. At the end of each frame the track is confirmed if L >= T_2,
    else deleted if L is more than `tentative_drop` below its own maximum over the frames' ends. Infinity is
    decided, not guessed: no frame can add to the score (S >= R), or the track is deleted, or S is steady.

    order                      "adversary" or "benign" per agent, in index order; "ABB" is short for the same
    noise_cov                  R[2, 2], m²; default sqrt(5) I, so that det R = 5
    initial_velocity_variance  per axis, (m/s)²
    process_noise              q of white-noise acceleration, m²/s³: Q = q [[dt³/3, dt²/2], [dt²/2, dt]]
    dt                         length of a frame, s
    """
    roles = _roles(order)
    if "adversary" not in roles:
        return math.inf
    _require_positive(dt=dt)
    _require("process_noise", process_noise, 0.0 <= process_noise < math.inf, "a number of at least 0")
    variance = initial_velocity_variance
    _require("initial_velocity_variance", variance, 0.0 <= variance < math.inf, "a number of at least 0")
    noise = _covariance("noise_cov", math.sqrt(5.0) * np.eye(2) if noise_cov is None else noise_cov)
    _require("noise_cov", noise.tolist(), noise.shape == (2, 2), "a 2x2 matrix: positions are planar")
    cov = np.kron(np.diag([0.0, variance]), np.eye(2))
    cov[:2, :2] = noise
    transition, motion_noise = _constant_velocity(dt, process_noise)
    agents = _AgentByAgent(noise, p_detect, beta_fp)
    missing = _missing_score(p_detect=p_detect, beta_fp=beta_fp, beta_nt=beta_nt, alpha=alpha, beta=beta)
    gained, cov = agents.look(roles[roles.index("adversary") + 1 :], cov)
    frame, peak = 1, gained
    while gained < missing:
        if gained < peak - tentative_drop or agents.largest_change(roles) <= 0.0:
            return math.inf
        predicted = transition @ cov @ transition.T + motion_noise
        change, later = agents.look(roles, predicted)
        if np.all(np.abs(later - cov) <= _CONVERGED * np.abs(predicted)):
            return float(frame + math.ceil((missing - gained) / change)) if change > 0.0 else math.inf
        frame, gained, cov = frame + 1, gained + change, later
        peak = max(peak, gained)
    return float(frame)


class _AgentByAgent:
    """What the agents of one frame do to a track's score and covariance, one after another, at d² = 0."""

    def __init__(self, noise: Matrix, p_detect: float, beta_fp: float) -> None:
        self.noise = noise  # R[2, 2]
        self.unit_gain = max_hit_gain(p_detect=p_detect, beta_fp=beta_fp, det_r=1.0)  # ΔL for det S = 1
        self.miss = math.log1p(-p_detect)

    def largest_change(self, roles: tuple[str, ...]) -> float:
        """Prop. 2: the score change of a frame in the limit S = R."""
        gain = self.unit_gain - 0.5 * math.log(np.linalg.det(self.noise))
        return roles.count("adversary") * gain + roles.count("benign") * self.miss

    def look(self, roles: tuple[str, ...], cov: Matrix) -> tuple[float, Matrix]:
        """Score change of the frame and covariance[4, 4] after it: K = P Hᵀ S⁻¹, P <- P - K S Kᵀ per hit."""
        change = 0.0
        for role in roles:
            if role == "benign":
                change += self.miss
                continue
            innovation_cov = cov[:2, :2] + self.noise
            change += self.unit_gain - 0.5 * math.log(np.linalg.det(innovation_cov))
            cov = cov - cov[:, :2] @ np.linalg.solve(innovation_cov, cov[:2, :])
        return change, cov


def _constant_velocity(dt: float, process_noise: float) -> tuple[Matrix, Matrix]:
    """Transition F[4, 4] and white-noise-acceleration covariance Q[4, 4] of the state [x, y, vx, vy]."""
    per_axis = np.array([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]])
    return np.kron([[1.0, dt], [0.0, 1.0]], np.eye(2)), np.kron(process_noise * per_axis, np.eye(2))


def _missing_score(*, p_detect: float, beta_fp: float, beta_nt: float, alpha: float, beta: float) -> float:
    """T_2 - L_0: what a newborn track lacks to be confirmed, in nats."""
    born = initial_score(p_detect=p_detect, beta_fp=beta_fp, beta_nt=beta_nt)
    return score_thresholds(alpha=alpha, beta=beta).confirm - born


def _chi_square_quantile(probability: float, eta: int) -> float:
    """G with P[χ²_η <= G] = probability; -2 ln(1 - probability) for the usual η = 2."""
    if eta == 2:
        return -2.0 * math.log1p(-probability)
    from scipy.special import gammaincinv  # only measurements that are not planar need it

    return 2.0 * float(gammaincinv(0.5 * eta, probability))


def _roles(order: Iterable[str]) -> tuple[str, ...]:
    roles = tuple({"A": "adversary", "B": "benign"}.get(role, role) for role in order)
    for role in roles:
        known = role in ("adversary", "benign")
        _require("order", role, known, '"adversary" or "benign" per agent, or a text such as "ABB"')
    return roles


def _covariance(name: str, value: ArrayLike) -> Matrix:
    cov = np.asarray(value, dtype=np.float64)
    square = cov.ndim == 2 and cov.shape[0] == cov.shape[1] and bool(np.all(np.isfinite(cov)))
    valid = square and np.allclose(cov, cov.T) and float(np.linalg.eigvalsh(cov).min()) > 0.0
    _require(name, cov.tolist(), valid, "a symmetric positive definite matrix")
    return cov


def _require_positive(**values: float) -> None:
    for name, value in values.items():
        _require(name, value, 0.0 < value < math.inf, "a positive number")


def _require_count(**values: int) -> None:
    for name, value in values.items():
        _require(name, value, value >= 0 and value == int(value), "a count of at least 0")


def _require(name: str, value: object, valid: bool, expected: str) -> None:
    if not valid:
        raise ValueError(f"{name} = {value!r}: expected {expected}")
