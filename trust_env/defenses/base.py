"""What defenses have in common: the contract, the verdict, and when a track is fit to be shown.

A built-in defense is a class with two kernels, and says what memory and what parameters they read. A user's own
has two methods, `reset(shape, worlds)` and `update(evidence) -> Verdict`, and works on whole batches in NumPy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np

from trust_env.compiled.kernels import kernel
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
    to_delete: bool[W, J], the tracker is about to delete the track; track_mean[W, J, 4], track_cov[W, J, 4, 4]
    (m, m/s); expected, detected, held: bool[W, K, J]; detections[W, K, D, 2] (m) with detection_count int[W,
    K]; assignment int[W, K, D] (track column, -1 none); innovation[W, K, J, 2], innovation_cov[W, K, J, 2,
    2], distance2[W, K, J] of the hits (NaN: no hit); agent_score[W, K, J], what each agent has contributed to
    a score; pose[W, K, 3]; frame int[W]; dt[W] (s).
    """

    track_id: np.ndarray
    status: np.ndarray
    age: np.ndarray
    score: np.ndarray
    to_delete: np.ndarray
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

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray]) -> Evidence:
        """Live views of the worlds' arrays; numbers of a world are [W]."""
        found = {field.name: arrays[_ARRAYS.get(field.name, field.name)] for field in fields(cls)}
        return cls(**found)

    @property
    def existence_probability(self) -> np.ndarray:
        """1 / (1 + e^-L) `[W, J]` (Hallyburton & Pajic 2024, Eq. 3b)."""
        from scipy.special import expit  # takes a tenth of a second to import

        return expit(self.score)

    @property
    def confirmed(self) -> np.ndarray:
        """bool[W, J]: confirmed tracks that are not about to be deleted."""
        return (self.status == CONFIRMED) & ~self.to_delete


# What evidence calls by other names than the worlds' arrays.
_ARRAYS = {
    "status": "track_status",
    "age": "track_age",
    "score": "track_score",
    "to_delete": "track_to_delete",
    "detections": "report_detections",
    "detection_count": "report_count",
}


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
    """A defense that runs compiled, inside the frame: a class in a file of its own and a line in the registry.

    parameters, memory: fields by name, as in `trust_env.world.fields` ("f8 K 2 | meaning"), which the kernels
    read as `world.NAME.field`, NAME being the defense's in the registry; an axis may be a letter of `lengths`.
    scratch: the same of what is only needed while a frame is judged.
    needs_innovations: whether `evidence.innovation`, `innovation_cov` and `distance2` are kept.
    """

    parameters: ClassVar[Mapping[str, str]] = {}
    memory: ClassVar[Mapping[str, str]] = {}
    scratch: ClassVar[Mapping[str, str]] = {}
    needs_innovations: ClassVar[bool] = False

    @staticmethod
    @kernel
    def reset(world):
        """An episode begins: forget everything."""

    @staticmethod
    @kernel
    def judge(world):
        """Write the verdict on a frame over the neutral one: no opinion, all confirmed tracks published."""

    def values(self, n_agents: int) -> dict[str, Any]:
        """What the kernels find in the fields of `parameters`."""
        return {}

    def lengths(self, n_agents: int) -> dict[str, int]:
        """Lengths of axes that only this defense has."""
        return {}

    def params(self) -> dict[str, Any]:
        """What the defense was built with, to print and to save."""
        return {}

    @classmethod
    def presets(cls) -> Mapping[str, Mapping[str, Any]]:
        """Parameters by preset, the default one first, where the class takes them as keywords."""
        return {}

    @classmethod
    def choices(cls, parameter: str) -> list[str]:
        """What a parameter can be, where there are names to choose from."""
        return []


def fits_publication(confirmed: np.ndarray, track_trust: np.ndarray) -> np.ndarray:
    """bool[W, J]: confirmed, and trust of at least 0.5 or no opinion."""
    return confirmed & ~(track_trust < ACCEPT)


@kernel
def clear_verdict(world):
    """No opinion, every confirmed track fit for publication, nothing kept."""
    tracks, verdict = world.tracks, world.verdict
    for k in range(verdict.agent_trust.shape[0]):
        verdict.agent_trust[k], verdict.agent_trust_var[k] = np.nan, np.nan
    for j in range(tracks.count):
        verdict.track_trust[j], verdict.track_trust_var[j], verdict.keep[j] = np.nan, np.nan, False
        verdict.publish[j] = tracks.status[j] == CONFIRMED and not tracks.to_delete[j]


@kernel
def weigh_agents(world):
    """The weight of an agent in the next frame: its trust, 1 where there is no opinion."""
    verdict = world.verdict
    for k in range(verdict.agent_trust.shape[0]):
        trust = verdict.agent_trust[k]
        verdict.agent_weight[k] = 1.0 if np.isnan(trust) else trust
