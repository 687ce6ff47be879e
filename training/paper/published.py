"""The numbers that the authors' own code gives in the two case studies, from cdc2024.json."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

CASES = ("case1", "case2")
SUPPRESSED = "_fn"  # ends the name of a case with suppressions in place of its injections
N_AGENTS, TRUSTED = 3, 1  # the agent that has the strong prior in half of the panels
PanelKey = tuple[str, bool]  # case, whether agent 1 has the strong prior


@dataclass(frozen=True)
class TrackedObject:
    """A target or a false positive: what a track of the paper's cases is of, and who sees it."""

    kind: str  # "true" | "fp" | "hidden": a target that an agent keeps silent about
    position: tuple[float, float]  # m
    in_fov_of: tuple[int, ...]
    detected_by: tuple[int, ...]

    @property
    def seen_by_one(self) -> bool:
        """Whether one agent alone sees the place, so that nobody can agree or disagree."""
        return len(self.in_fov_of) == 1

    @property
    def even_split(self) -> bool:
        """Whether as many agents report it as do not."""
        return 2 * len(self.detected_by) == len(self.in_fov_of)

    @property
    def name(self) -> str:
        seen = ", ".join(map(str, self.in_fov_of))
        silent = ", ".join(str(k) for k in self.in_fov_of if k not in self.detected_by)
        source = {"true": "target", "fp": f"FP by {self.detected_by[0]}", "hidden": f"target hidden by {silent}"}
        return f"{source[self.kind]} in view of {seen}"

    @property
    def mirrored(self) -> TrackedObject:
        """For a false positive the target in its place that its agent suppresses: who reported it is silent."""
        if self.kind == "true":
            return self
        return replace(self, kind="hidden", detected_by=tuple(k for k in self.in_fov_of if k not in self.detected_by))


@dataclass(frozen=True, eq=False)
class Panel:
    """Trust frame by frame: means of tracks[J, T] (NaN: no such track yet) and agents[K, T].

    beliefs[J + K, 2]: α and β of tracks and then agents in the last frame.
    """

    tracks: np.ndarray
    agents: np.ndarray
    beliefs: np.ndarray

    @property
    def final_trust(self) -> np.ndarray:
        """Trust in tracks and then agents in the last frame, [J + K]."""
        return np.concatenate([self.tracks[:, -1], self.agents[:, -1]])


@cache
def _published() -> dict[str, Any]:
    return json.loads(files("trust_env.training.paper").joinpath("cdc2024.json").read_text(encoding="utf-8"))


def _panel_data(key: PanelKey) -> dict[str, Any]:
    case, trusted = key
    return next(p for p in _published()["panels"] if p["case"] == case and bool(p["trusted"]) == trusted)


def panel_keys() -> tuple[PanelKey, ...]:
    return tuple((p["case"], bool(p["trusted"])) for p in _published()["panels"])


def suppressed_keys() -> tuple[PanelKey, ...]:
    """The same panels with suppressions in place of injections, which the paper does not have."""
    return tuple((case + SUPPRESSED, trusted) for case, trusted in panel_keys())


def objects(case: str) -> tuple[TrackedObject, ...]:
    """The objects of a case, in the order of the tracks of its panels; those of `case1_fn` mirror `case1`."""
    found = tuple(
        TrackedObject(t["kind"], tuple(t["position"]), tuple(t["in_fov_of"]), tuple(t["detected_by"]))
        for t in _panel_data((case.removesuffix(SUPPRESSED), False))["tracks"]
    )
    return tuple(obj.mirrored for obj in found) if case.endswith(SUPPRESSED) else found


def published_panels() -> dict[PanelKey, Panel]:
    return {key: _panel(key) for key in panel_keys()}


def _panel(key: PanelKey) -> Panel:
    data = _panel_data(key)
    tracks, agents = (np.array([row["mean"] for row in data[name]], dtype=float) for name in ("tracks", "agents"))
    return Panel(tracks, agents, final_beliefs(key))


def final_beliefs(key: PanelKey) -> np.ndarray:
    """α and β of tracks and then agents after the last frame, [J + K, 2]."""
    data = _panel_data(key)
    return np.array([row["final"] for name in ("tracks", "agents") for row in data[name]])


def evidence(key: PanelKey) -> list[dict[str, Any]]:
    """What the authors' tracker gave their estimator, as `trust_env.replay_evidence` takes it."""
    tracks, frames = _panel_data(key)["tracks"], []
    for frame in range(_published()["frames"]):
        ids = [i for i, track in enumerate(tracks) if track["first_frame"] <= frame]
        expected, detected = (
            np.array([[k in tracks[i][name] for i in ids] for k in range(N_AGENTS)], dtype=bool).reshape(N_AGENTS, -1)
            for name in ("in_fov_of", "detected_by")
        )
        frames.append({"track_id": ids, "expected": expected, "detected": detected, "held": detected})
    return frames
