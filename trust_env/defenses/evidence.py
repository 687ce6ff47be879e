"""What a user's own defense is given: one frame's evidence of a batch of worlds, and what the tracker believes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from trust_env.scenario import Fovs
from trust_env.world.random import DEFENSE, uniforms
from trust_env.world.tracking.score import CONFIRMED


class Shape(NamedTuple):
    """Sizes of the arrays a defense works on: worlds W, agents K, central track columns J, detections of an
    agent D.
    """

    W: int
    K: int
    J: int
    D: int


@dataclass(frozen=True)
class TrackerBelief:
    """What the tracker believes, which is not always true.

    p_detect[K]; beta_fp[K], beta_nt[K] (1/m^2), densities of false positives and of new targets; noise_cov[K,
    2, 2] (m^2), R; gate, the limit of the squared Mahalanobis distance; velocity_variance ((m/s)^2), of a new
    track's vx and vy; process_noise (m^2/s^3); prior_compromised[K], the probability that an agent is
    compromised, NaN where the scenario does not say.
    """

    p_detect: np.ndarray
    beta_fp: np.ndarray
    beta_nt: np.ndarray
    noise_cov: np.ndarray
    gate: float
    velocity_variance: float
    process_noise: float
    prior_compromised: np.ndarray

    @classmethod
    def of(cls, read: Callable[[str], np.ndarray]) -> TrackerBelief:
        """From what reads the parameters by name."""
        return cls(
            p_detect=read("believed_p_detect"),
            beta_fp=read("believed_beta_fp"),
            beta_nt=read("believed_beta_nt"),
            noise_cov=read("noise_cov"),
            gate=float(read("gate")),
            velocity_variance=float(read("velocity_variance")),
            process_noise=float(read("process_noise")),
            prior_compromised=read("prior_compromised"),
        )


@dataclass(frozen=True)
class Evidence:
    """One frame's evidence, as arrays with leading axis W (worlds). Columns with `status` 0 are empty; their
    entries mean nothing.

    Tracks, after all updates of the frame: track_id, status (0 empty, 1 tentative, 2 confirmed), age (frames):
    int[W, J]; score (nats): float[W, J]; to_delete: bool[W, J], the tracker is about to delete the track;
    track_mean[W, J, 4], track_cov[W, J, 4, 4] (m, m/s); predicted_mean, predicted_cov: the same before the
    frame's first report, one epoch for all agents (NaN: the track is new).

    Agents and tracks, bool[W, K, J]: expected, the FOV holds the track's mean; detected, any detection of the
    agent lies within the track's gate (or `evidence.near_distance`), a neighbour's or clutter too; hit, a
    detection was assigned to the track, at most one per agent and frame (that which started the track is
    none); held, a *confirmed* local track of the agent lies within `evidence.hold_distance` of the confirmed
    track, so that all agents look bad in an episode's first frames, while their trackers confirm. inside[W, K,
    J]: probability that the track lies in the FOV, by its mean and covariance; near an FOV's edge an honest
    agent misses often what it was expected to see. agent_score[W, K, J] (nats): what each agent has
    contributed to a score.

    Hits: innovation[W, K, J, 2] (m), innovation_cov[W, K, J, 2, 2] (m^2) and distance2[W, K, J] against the
    track as the agents before left it (NaN: no hit).

    Reports: detections[W, K, D, 2] (m) with detection_count int[W, K]; assignment int[W, K, D] (track column,
    -1 none).

    Where and when: pose[W, K, 3] (m, m, rad); covered bool[W, K, Q], whether the FOV covers a cell of a grid of
    40 x 40 over all FOVs, cell_area[W] (m^2): from them the area that any set of agents covers; frame, seed,
    world_id, episode int[W]; dt[W] (s). belief: what the tracker believes; fovs: the FOVs' shapes, as
    functions of poses.
    """

    track_id: np.ndarray
    status: np.ndarray
    age: np.ndarray
    score: np.ndarray
    to_delete: np.ndarray
    track_mean: np.ndarray
    track_cov: np.ndarray
    predicted_mean: np.ndarray
    predicted_cov: np.ndarray
    expected: np.ndarray
    detected: np.ndarray
    hit: np.ndarray
    held: np.ndarray
    inside: np.ndarray
    agent_score: np.ndarray
    innovation: np.ndarray
    innovation_cov: np.ndarray
    distance2: np.ndarray
    detections: np.ndarray
    detection_count: np.ndarray
    assignment: np.ndarray
    pose: np.ndarray
    covered: np.ndarray
    cell_area: np.ndarray
    frame: np.ndarray
    seed: np.ndarray
    world_id: np.ndarray
    episode: np.ndarray
    dt: np.ndarray
    belief: TrackerBelief
    fovs: Fovs

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], belief: TrackerBelief, fovs: Fovs) -> Evidence:
        """Live views of the worlds' arrays; numbers of a world are [W]."""
        names = [field.name for field in fields(cls) if field.name not in ("belief", "fovs")]
        return cls(**{name: arrays[_ARRAYS.get(name, name)] for name in names}, belief=belief, fovs=fovs)

    @property
    def existence_probability(self) -> np.ndarray:
        """1 / (1 + e^-L) `[W, J]` (Hallyburton & Pajic 2024, Eq. 3b)."""
        from scipy.special import expit  # takes a tenth of a second to import

        return expit(self.score)

    @property
    def confirmed(self) -> np.ndarray:
        """bool[W, J]: confirmed tracks that are not about to be deleted."""
        return (self.status == CONFIRMED) & ~self.to_delete

    def contains(self, points: np.ndarray) -> np.ndarray:
        """bool[W, K, P]: whether each agent's FOV holds the points [W, P, 2] (m)."""
        x, y, heading = np.moveaxis(self.pose, -1, 0)
        pose = np.stack([x, y, np.cos(heading), np.sin(heading)], axis=-1)
        return self.fovs.contains(pose, points[:, None])

    def uniforms(self, count: int) -> np.ndarray:
        """U[0, 1) draws `[W, count]`, a function of seed, world, episode and frame and of nothing else."""
        return uniforms(int(self.seed[0]), self.world_id, self.episode, DEFENSE, self.frame, count)


# What evidence calls by other names than the worlds' arrays.
_ARRAYS = {
    "status": "track_status",
    "age": "track_age",
    "score": "track_score",
    "to_delete": "track_to_delete",
    "detections": "report_detections",
    "detection_count": "report_count",
}
