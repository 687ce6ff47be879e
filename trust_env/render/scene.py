"""A frame as what there is to see, in metres: read from the world once, then drawn by an image or as text.

Everything belongs to the frame just scored: its reports, the tracks after it, and the truth that they were
scored against. The raw detections that the agents already hold are those of the next frame and are not shown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from trust_env.world.fields import FRAME_METRICS
from trust_env.world.origin import FIRST_INJECTION
from trust_env.world.tracking.score import CONFIRMED

if TYPE_CHECKING:
    from trust_env.parallel import TrustEnv

DetectionKind = Literal["honest", "clutter", "injected"]
TrackKind = Literal["published", "hidden", "tentative"]
_MARGIN = 0.03  # of the longer side, around everything


@dataclass(frozen=True)
class Agent:
    """An agent, its FOV and what the defense thinks of it (trust NaN: no opinion)."""

    name: str
    adversary: bool
    position: np.ndarray  # [2], m
    outline: np.ndarray  # [n, 2], m, corners of the FOV
    trust: float
    deviation: float  # standard deviation of the trust


@dataclass(frozen=True)
class Target:
    """A target; `visible`: some FOV holds it, `shown`: a track of the picture is assigned to it."""

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
    """A track; `hidden` is confirmed but not published; `false`: published and assigned to no target."""

    id: int
    kind: TrackKind
    false: bool
    position: np.ndarray  # [2], m
    velocity: np.ndarray  # [2], m/s
    cov: np.ndarray  # [2, 2], m^2
    trust: float


@dataclass(frozen=True)
class Scene:
    """Everything that a frame shows. extent: x_min, x_max, y_min, y_max in m, the same all episode."""

    scenario: str
    defense: str
    frame: int
    horizon: int
    dt: float
    accuse_below: float
    extent: tuple[float, float, float, float]
    agents: list[Agent]
    targets: list[Target]
    detections: list[Detection]
    tracks: list[Track]
    metrics: dict[str, float]


def read_scene(env: TrustEnv) -> Scene:
    """The present frame of an environment."""
    scenario, frame = env.scenario, int(env.arrays.frame.reshape(-1)[0])
    agents = _agents(env)
    return Scene(
        scenario=scenario.name,
        defense=type(env.worlds.defense).__name__.lower(),
        frame=frame,
        horizon=env.max_cycles,
        dt=scenario.dt,
        accuse_below=scenario.metrics.accuse_below,
        extent=_extent(env, agents),
        agents=agents,
        targets=_targets(env, judged=frame > 0),
        detections=_detections(env) if frame > 0 else [],
        tracks=_tracks(env),
        metrics=dict(zip(FRAME_METRICS, env.arrays.metrics[0].tolist(), strict=True)),
    )


def _agents(env: TrustEnv) -> list[Agent]:
    a = env.arrays
    return [
        Agent(
            name=name,
            adversary=role == "adversary",
            position=a.pose[0, k, :2].copy(),
            outline=env.scenario.agent(k).fov.shape.outline(a.pose[0, k]),
            trust=float(a.agent_trust[0, k]),
            deviation=math.sqrt(float(a.agent_trust_var[0, k])),
        )
        for k, (name, role) in enumerate(zip(env.possible_agents, env.scenario.roles, strict=True))
    ]


def _extent(env: TrustEnv, agents: list[Agent]) -> tuple[float, float, float, float]:
    """The area and all FOVs, with a margin."""
    area = np.asarray(env.scenario.area).reshape(2, 2).T
    corners = np.concatenate([area, *(agent.outline for agent in agents)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = _MARGIN * float((high - low).max())
    return (low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin)


def _targets(env: TrustEnv, judged: bool) -> list[Target]:
    a = env.arrays
    alive, state = (
        (a.scored_alive[0], a.scored_state[0]) if judged else (a.target_alive[0], a.target_state[0])
    )
    shown = set(a.track_target[0, a.published[0]].tolist()) if judged else set()
    return [
        Target(state[n, :2].copy(), bool(judged and a.scored_visible[0, n]), n in shown)
        for n in np.flatnonzero(alive).tolist()
    ]


def _detections(env: TrustEnv) -> list[Detection]:
    a = env.arrays
    return [
        Detection(k, _detection_kind(int(a.report_origin[0, k, d])), a.report_detections[0, k, d].copy())
        for k in range(len(env.possible_agents))
        for d in range(int(a.report_count[0, k]))
    ]


def _detection_kind(origin: int) -> DetectionKind:
    if origin <= FIRST_INJECTION:
        return "injected"
    return "clutter" if origin < 0 else "honest"


def _tracks(env: TrustEnv) -> list[Track]:
    a = env.arrays
    kinds: dict[tuple[bool, bool], TrackKind] = {(True, True): "published", (True, False): "hidden"}
    return [
        Track(
            id=int(a.track_id[0, j]),
            kind=kinds.get((bool(a.track_status[0, j] == CONFIRMED), bool(a.published[0, j])), "tentative"),
            false=bool(a.published[0, j] and a.track_target[0, j] < 0),
            position=a.track_mean[0, j, :2].copy(),
            velocity=a.track_mean[0, j, 2:].copy(),
            cov=a.track_cov[0, j, :2, :2].copy(),
            trust=float(a.track_trust[0, j]),
        )
        for j in np.flatnonzero(a.track_status[0]).tolist()
    ]
