"""What defenses have in common: the contract, the verdict, and when a track is fit to be shown.

A built-in defense is a class with two kernels, and says what memory and what parameters they read. A user's own
has two methods, `reset(shape, worlds)` and `update(evidence) -> Verdict`, and works on whole batches in NumPy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.defenses.evidence import Evidence, Shape
from trust_env.world.picture import clear_track_verdict

ACCEPT = 0.5  # a track is shown while its trust is at least this, or nobody has an opinion
OPTIONAL = ("innovations", "predictions", "inside", "coverage")  # evidence gathered only for who asks for it


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
    scratch: the same, of what is only needed while a frame is judged.
    needs: of `OPTIONAL`, what its kernels read of `world.evidence`: innovations (innovation, innovation_cov,
    distance2), predictions (predicted_mean, predicted_cov), inside, coverage (covered, cell_area).
    reference: whether it is for evaluation only, as something to compare with: it knows what no defense can know,
    or decides nothing.
    """

    parameters: ClassVar[Mapping[str, str]] = {}
    memory: ClassVar[Mapping[str, str]] = {}
    scratch: ClassVar[Mapping[str, str]] = {}
    needs: ClassVar[tuple[str, ...]] = ()
    reference: ClassVar[bool] = False

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
    verdict = world.verdict
    for k in range(verdict.agent_trust.shape[0]):
        verdict.agent_trust[k], verdict.agent_trust_var[k] = np.nan, np.nan
    clear_track_verdict(world)


@kernel
def weigh_agents(world):
    """The weight of an agent in the next frame: its trust, 1 where there is no opinion."""
    verdict = world.verdict
    for k in range(verdict.agent_trust.shape[0]):
        trust = verdict.agent_trust[k]
        verdict.agent_weight[k] = 1.0 if np.isnan(trust) else trust
