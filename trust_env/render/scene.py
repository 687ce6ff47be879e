"""What a frame shows, in metres: read from the world once, then drawn as an image or as text.

Everything belongs to the frame just scored: its reports, the tracks after it, and the true targets that these
were scored against. The raw detections that the agents already hold are the next frame's and are not shown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from trust_env.defenses import name_of
from trust_env.world.fields import FRAME_METRICS
from trust_env.world.origin import FIRST_INJECTION
from trust_env.world.tracking.score import CONFIRMED

if TYPE_CHECKING:
    from trust_env.batch import Batch
    from trust_env.scenario import Scenario

Extent = tuple[float, float, float, float]  # x_min, x_max, y_min, y_max, m
DetectionKind = Literal["honest", "clutter", "injected"]
TrackKind = Literal["published", "hidden", "tentative"]
_MARGIN = 0.03  # fraction of the longer side, around everything


@dataclass(frozen=True)
class Agent:
    """An agent, its FOV and the defense's trust in it (NaN: no opinion)."""

    name: str
    adversary: bool
    position: np.ndarray  # [2], m
    outline: np.ndarray  # [n, 2], m, corners of the FOV
    trust: float
    trust_std: float


@dataclass(frozen=True)
class Target:
    """A target; `visible`: it lies in some FOV; `shown`: a track of the picture is assigned to it."""

    position: np.ndarray  # [2], m
    visible: bool
    shown: bool


@dataclass(frozen=True)
class Detection:
    """A detection as reported in this frame."""

    agent: int
    kind: DetectionKind
    position: np.ndarray  # [2], m


@dataclass(frozen=True)
class Track:
    """A track; "hidden": confirmed but not published; `false`: published and assigned to no target."""

    id: int
    kind: TrackKind
    false: bool
    position: np.ndarray  # [2], m
    velocity: np.ndarray  # [2], m/s
    cov: np.ndarray  # [2, 2], m^2
    trust: float
    trust_std: float


@dataclass(frozen=True)
class Scene:
    """Everything that a frame shows; its extent stays the same for an episode."""

    scenario: str
    defense: str
    frame: int
    horizon: int
    dt: float  # s
    accuse_below: float  # trust below which an agent counts as accused
    extent: Extent
    agents: list[Agent]
    targets: list[Target]
    detections: list[Detection]
    tracks: list[Track]
    metrics: dict[str, float]


def read_scene(worlds: Batch) -> Scene:
    """The present frame of the first world."""
    scenario, frame = worlds.scenario, int(worlds.arrays.frame[0])
    agents = _read_agents(worlds)
    return Scene(
        scenario=scenario.name,
        defense=name_of(worlds.defense),
        frame=frame,
        horizon=worlds.horizon,
        dt=scenario.dt,
        accuse_below=scenario.metrics.accuse_below,
        extent=_extent(scenario, agents),
        agents=agents,
        targets=_read_targets(worlds, scored=frame > 0),
        detections=_read_detections(worlds) if frame > 0 else [],
        tracks=_read_tracks(worlds),
        metrics=dict(zip(FRAME_METRICS, worlds.arrays.metrics[0].tolist(), strict=True)),
    )


def _read_agents(worlds: Batch) -> list[Agent]:
    a, scenario = worlds.arrays, worlds.scenario
    return [
        Agent(
            name=name,
            adversary=role == "adversary",
            position=a.pose[0, k, :2].copy(),
            outline=scenario.agent(k).fov.shape.outline(a.pose[0, k]),
            trust=float(a.agent_trust[0, k]),
            trust_std=math.sqrt(float(a.agent_trust_var[0, k])),
        )
        for k, (name, role) in enumerate(zip(scenario.agent_names, scenario.roles, strict=True))
    ]


def _extent(scenario: Scenario, agents: list[Agent]) -> Extent:
    """The area and all FOVs, with a margin."""
    area = np.asarray(scenario.area).reshape(2, 2).T
    corners = np.concatenate([area, *(agent.outline for agent in agents)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = _MARGIN * float((high - low).max())
    return (low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin)


def _read_targets(worlds: Batch, scored: bool) -> list[Target]:
    """The targets that the frame was scored against, or before the first frame those that there are."""
    a = worlds.arrays
    if not scored:
        alive = np.flatnonzero(a.target_alive[0]).tolist()
        return [Target(a.target_state[0, n, :2].copy(), visible=False, shown=False) for n in alive]
    shown = set(a.track_target[0, a.published[0]].tolist())
    return [
        Target(a.scored_state[0, n, :2].copy(), bool(a.scored_visible[0, n]), n in shown)
        for n in np.flatnonzero(a.scored_alive[0]).tolist()
    ]


def _read_detections(worlds: Batch) -> list[Detection]:
    a = worlds.arrays
    return [
        Detection(k, _detection_kind(int(a.report_origin[0, k, d])), a.report_detections[0, k, d].copy())
        for k in range(len(worlds.scenario.agent_names))
        for d in range(int(a.report_count[0, k]))
    ]


def _detection_kind(origin: int) -> DetectionKind:
    if origin <= FIRST_INJECTION:
        return "injected"
    return "clutter" if origin < 0 else "honest"


def _read_tracks(worlds: Batch) -> list[Track]:
    a = worlds.arrays
    return [
        Track(
            id=int(a.track_id[0, j]),
            kind=_track_kind(int(a.track_status[0, j]), bool(a.published[0, j])),
            false=bool(a.published[0, j] and a.track_target[0, j] < 0),
            position=a.track_mean[0, j, :2].copy(),
            velocity=a.track_mean[0, j, 2:].copy(),
            cov=a.track_cov[0, j, :2, :2].copy(),
            trust=float(a.track_trust[0, j]),
            trust_std=math.sqrt(float(a.track_trust_var[0, j])),
        )
        for j in np.flatnonzero(a.track_status[0]).tolist()
    ]


def _track_kind(status: int, published: bool) -> TrackKind:
    if status != CONFIRMED:
        return "tentative"
    return "published" if published else "hidden"
