"""What defenses have in common: the contract, the verdict, and when a track is fit to be shown.

A built-in defense is a class with a `code`, by which the engine finds its kernel, and `pack`, which turns its
parameters into numbers. A user's own has two methods, `reset(shape, worlds)` and `update(evidence) ->
Verdict`, and works on whole batches in NumPy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np

from trust_env.compiled.jit import compiled
from trust_env.world.fields import F, flags1, floats1, ints1, whole
from trust_env.world.tracking.score import CONFIRMED

ACCEPT = 0.5  # a track is shown while its trust is at least this, or nobody has an opinion


class Shape(NamedTuple):
    """Sizes of the arrays a defense works on: worlds W, agents K, central track columns J, detections of an
    agent D.
    """

    W: int
    K: int
    J: int
    D: int


@dataclass(frozen=True)
class Evidence:
    """One frame's evidence, as arrays with leading axis W (worlds). Columns with `status` 0 are empty; their
    entries mean nothing.

    track_id, status (0 empty, 1 tentative, 2 confirmed), age (frames): int[W, J]; score (nats): float[W, J];
    doomed: bool[W, J], the tracker is about to delete the track; track_mean[W, J, 4], track_cov[W, J, 4, 4]
    (m, m/s); expected, detected, held: bool[W, K, J]; detections[W, K, D, 2] (m) with detection_count int[W,
    K]; assignment int[W, K, D] (track column, -1 none); innovation[W, K, J, 2], innovation_cov[W, K, J, 2,
    2], distance2[W, K, J] of the hits (NaN: no hit); agent_score[W, K, J], what each agent has contributed to
    a score; pose[W, K, 3]; frame int[W]; dt[W] (s).
    """

    track_id: np.ndarray
    status: np.ndarray
    age: np.ndarray
    score: np.ndarray
    doomed: np.ndarray
    track_mean: np.ndarray
    track_cov: np.ndarray
    expected: np.ndarray
    detected: np.ndarray
    held: np.ndarray
    detections: np.ndarray
    detection_count: np.ndarray
    assignment: np.ndarray
    innovation: np.ndarray
    innovation_cov: np.ndarray
    distance2: np.ndarray
    agent_score: np.ndarray
    pose: np.ndarray
    frame: np.ndarray
    dt: np.ndarray

    @property
    def existence_probability(self) -> np.ndarray:
        """1 / (1 + e^-L) `[W, J]` (Hallyburton & Pajic 2024, Eq. 3b)."""
        from scipy.special import expit  # takes a tenth of a second to import

        return expit(self.score)

    @property
    def confirmed(self) -> np.ndarray:
        """bool[W, J]: confirmed tracks that are not about to be deleted."""
        return (self.status == CONFIRMED) & ~self.doomed


@dataclass(frozen=True)
class Verdict:
    """What a defense concludes from a frame. Everything has a neutral default.

    track_trust[W, J], agent_trust[W, K]: mean trust in [0, 1], NaN = no opinion; `…_var` their variances;
    publish bool[W, J]: tracks fit for the picture (default: trust of at least 0.5, or no opinion); keep
    bool[W, J]: tracks that the tracker must not delete; agent_weight[W, K] in [0, 1], for the actuation
    `weight` (default: the agent's trust, 1 where there is no opinion).
    """

    track_trust: np.ndarray | None = None
    agent_trust: np.ndarray | None = None
    track_trust_var: np.ndarray | None = None
    agent_trust_var: np.ndarray | None = None
    publish: np.ndarray | None = None
    keep: np.ndarray | None = None
    agent_weight: np.ndarray | None = None


@runtime_checkable
class Defense(Protocol):
    """A user's own defense."""

    def reset(self, shape: Shape, worlds: np.ndarray) -> None:
        """Episodes begin in the worlds where `worlds` (bool[W]) is set; all of them at the first call."""

    def update(self, evidence: Evidence) -> Verdict:
        """The verdict of one frame, for all worlds."""
        ...


class BuiltIn:
    """A defense that runs compiled, inside the frame."""

    code: ClassVar[int]
    history: int = 1  # frames of memory, the axis H

    def pack(self, n_agents: int) -> tuple[np.ndarray, np.ndarray]:
        """Parameters `[32]` and agent priors (α, β) `[K, 2]`."""
        return np.zeros(32), np.full((n_agents, 2), 0.5)

    def params(self) -> dict[str, Any]:
        """What the defense was built with, to print and to save."""
        return {}


def fits_publication(confirmed: np.ndarray, track_trust: np.ndarray) -> np.ndarray:
    """bool[W, J]: confirmed, and trust of at least 0.5 or no opinion."""
    return confirmed & ~(track_trust < ACCEPT)


@compiled
def clear_verdict(world):
    """No opinion, every confirmed track fit for publication, nothing kept."""
    for k in range(floats1(world, F.agent_trust).shape[0]):
        floats1(world, F.agent_trust)[k] = np.nan
        floats1(world, F.agent_trust_var)[k] = np.nan
    status, doomed, publish = (
        ints1(world, F.track_status),
        flags1(world, F.track_doomed),
        flags1(world, F.publish),
    )
    trust, variance, keep = (
        floats1(world, F.track_trust),
        floats1(world, F.track_trust_var),
        flags1(world, F.keep),
    )
    for j in range(whole(world, F.columns)):
        trust[j], variance[j], keep[j] = np.nan, np.nan, False
        publish[j] = status[j] == CONFIRMED and not doomed[j]
