"""What agents observe: one table of fields, from which the space, the slices, the kernel's offsets and the
documentation are made.

All entries are float32 in [-1, 1]. Positions are scaled either to the agent's own FOV (relative to the agent,
1.25 radii = 1) or to the scenario's extent.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

import numpy as np

from trust_env.compiled.kernels import inlined, kernel
from trust_env.world.tracking.score import CONFIRMED

if TYPE_CHECKING:
    from trust_env.scenario import Scenario

Agents = np.ndarray | list[int] | int  # indices in `possible_agents`

KNOWLEDGE = {"own": 0, "poses": 1, "picture": 2, "white_box": 3}
REACH = 1.25  # FOV radii that own detections are scaled by
SCORE_SCALE = 50.0  # nats

# name: (least knowledge, shared only, axes, unit and scaling)
_TABLE: dict[str, tuple[str, bool, str, str]] = {
    "role": ("own", False, "", "+1 adversary, -1 benign"),
    "time": ("own", False, "", "frame / horizon"),
    "pose": ("own", False, "4", "own x, y (extent), cos and sin of the heading"),
    "detections": (
        "own", False, "D 2", "own raw detections, nearest first: x, y relative to the agent (1.25 FOV radii)",
    ),
    "detections_mask": ("own", False, "D", "1 where there is a detection"),
    "report": ("own", False, "D 2", "own last report: x, y relative to the agent (1.25 FOV radii)"),
    "report_mask": ("own", False, "D", "1 where there is one"),
    "poses": ("poses", False, "K 4", "everyone's x, y (extent), cos and sin of the heading"),
    "fovs": ("poses", False, "K 3", "everyone's FOV: radius (extent), half width / π, heading / π"),
    "picture": ("picture", False, "J 4", "published tracks: x, y (extent), vx, vy (speed scale)"),
    "picture_mask": ("picture", False, "J", "1 where there is one"),
    "tracks": (
        "white_box", False, "J 4", "all central tracks by column: x, y (extent), vx, vy (speed scale)",
    ),
    "tracks_status": ("white_box", False, "J", "0 none, 0.5 tentative, 1 confirmed"),
    "tracks_score": ("white_box", False, "J", "track score / 50 nats, clipped"),
    "tracks_trust": ("white_box", False, "J 2", "mean and variance; -1 where there is no opinion"),
    "agents_trust": ("white_box", False, "K 2", "mean and variance; -1 where there is no opinion"),
    "shared_detections": (
        "own", True, "K D 2", "raw detections of the other adversaries: x, y (extent); 0 for benign agents",
    ),
    "shared_detections_mask": ("own", True, "K D", "1 where there is one"),
    "shared_reports": (
        "own", True, "K D 2", "last reports of the other adversaries: x, y (extent); 0 for benign agents",
    ),
    "shared_reports_mask": ("own", True, "K D", "1 where there is one"),
}  # fmt: skip
NAMES = tuple(_TABLE)
(
    ROLE, TIME, POSE, DETECTIONS, DETECTIONS_MASK, REPORT, REPORT_MASK, POSES, FOVS, PICTURE, PICTURE_MASK,
    TRACKS, TRACKS_STATUS, TRACKS_SCORE, TRACKS_TRUST, AGENTS_TRUST,
    SHARED_DETECTIONS, SHARED_DETECTIONS_MASK, SHARED_REPORTS, SHARED_REPORTS_MASK,
) = range(len(NAMES))  # fmt: skip


@dataclass(frozen=True)
class Field:
    """A stretch of the observation vector."""

    name: str
    slice: slice
    shape: tuple[int, ...]
    unit: str
    knowledge: str  # the least level that gives it


@dataclass(frozen=True)
class Scales:
    """What positions and velocities are divided by: `centre` [2] and `half` (m) of the extent, `speed` (m/s),
    `reach[K]` (m).
    """

    centre: np.ndarray
    half: float
    speed: float
    reach: np.ndarray


class ObservationTable(Mapping[str, Field]):
    """The fields that a scenario's knowledge level gives, in order. `table.size` is the length O of an
    observation.
    """

    def __init__(self, scenario: Scenario, scales: Scales, dims: Mapping[str, int]):
        level = KNOWLEDGE[scenario.knowledge]
        self.scales, self.size, self._fields = scales, 0, dict[str, Field]()
        for name, (least, shared, axes, unit) in _TABLE.items():
            if KNOWLEDGE[least] <= level and (not shared or scenario.coordination == "shared"):
                shape = tuple(int(a) if a.isdigit() else dims[a] for a in axes.split())
                length = math.prod(shape)
                self._fields[name] = Field(name, slice(self.size, self.size + length), shape, unit, least)
                self.size += length

    def __getitem__(self, name: str) -> Field:
        return self._fields[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def __len__(self) -> int:
        return len(self._fields)

    def offsets(self) -> np.ndarray:
        """Start of every field of the full table, -1 where this scenario does not give it: `[32]`, for the
        kernel.
        """
        out = np.full(32, -1, dtype=np.int64)
        out[: len(NAMES)] = [self._fields[name].slice.start if name in self._fields else -1 for name in NAMES]
        return out

    @overload
    def read(self, observation: np.ndarray, agents: str) -> np.ndarray: ...

    @overload
    def read(self, observation: np.ndarray, agents: Agents | None, names: str) -> np.ndarray: ...

    @overload
    def read(
        self, observation: np.ndarray, agents: Agents | None = None, names: tuple[str, ...] | list[str] | None = None
    ) -> dict[str, np.ndarray]: ...

    def read(
        self,
        observation: np.ndarray,
        agents: Agents | str | None = None,
        names: tuple[str, ...] | list[str] | str | None = None,
    ) -> dict[str, np.ndarray] | np.ndarray:
        """The fields of `observation[..., O]` in metres and m/s (float64), masks as booleans.

        names: of the fields that are wanted, as far as there are any; None: all, by name. One name gives its array
        alone, also in place of the agents: `read(observation, "detections")`.
        agents: the agents' indices in `possible_agents`, to be broadcast against the leading axes of `observation`
        (their FOVs scale what is relative); they may be left out where all FOVs reach as far, or where
        `observation[..., K, O]` holds all agents. ValueError: they may not; KeyError: there is no field of that name.
        """
        if isinstance(agents, str):
            agents, names = None, agents
        which = self._agents_of(observation) if agents is None else agents
        place = self._places(self._entries(observation, "pose"))
        if isinstance(names, str):
            return self._in_units(names, self._entries(observation, names), place, which)
        wanted = self if names is None else [name for name in self if name in names]
        return {name: self._in_units(name, self._entries(observation, name), place, which) for name in wanted}

    def _agents_of(self, observation: np.ndarray) -> Agents:
        """The agents whose observations these are, as far as it matters."""
        reach = self.scales.reach
        if (reach == reach[0]).all():
            return 0
        if observation.ndim > 1 and observation.shape[-2] == len(reach):
            return np.arange(len(reach))
        raise ValueError("the agents' FOVs reach differently far; expected agents, their indices in possible_agents")

    def _entries(self, observation: np.ndarray, name: str) -> np.ndarray:
        """A field as it stands in observations."""
        field = self._fields[name]
        return observation[..., field.slice].reshape((*observation.shape[:-1], *field.shape))

    def _places(self, entries: np.ndarray) -> np.ndarray:
        """m, [..., 2]"""
        return entries[..., :2].astype(np.float64) * self.scales.half + self.scales.centre

    def _in_units(self, name: str, entries: np.ndarray, place: np.ndarray, agents: Agents) -> np.ndarray:
        """A field as `read` gives it; the observing agents stand at place[..., 2] (m)."""
        scales = self.scales
        if name.endswith("mask"):
            return entries > 0.5
        if name in ("detections", "report"):
            reach = scales.reach[np.asarray(agents)][..., None, None]
            return entries.astype(np.float64) * reach + place[..., None, :]
        if name in ("shared_detections", "shared_reports"):
            return self._places(entries)
        values = entries.astype(np.float64)
        if name in ("pose", "poses", "picture", "tracks"):
            rest = values[..., 2:] * (scales.speed if name in ("picture", "tracks") else 1.0)
            return np.concatenate([self._places(entries), rest], axis=-1)
        unit = {"fovs": np.array([scales.half, math.pi, math.pi]), "tracks_score": SCORE_SCALE}
        return values * unit[name] if name in unit else values

    def markdown(self) -> str:
        """The table as documentation."""
        rows = ["| field | entries | shape | meaning and scaling |", "| --- | --- | --- | --- |"]
        rows += [f"| `{f.name}` | {f.slice.start}:{f.slice.stop} | {list(f.shape)} | {f.unit} |" for f in self.values()]
        return "\n".join(rows)


# --- kernels ---


@inlined
def _clip(value):
    return np.float32(min(1.0, max(-1.0, value)))


@inlined
def _flag(value):
    return np.float32(1.0) if value else np.float32(0.0)


@kernel
def observe(world):
    """Fill `observation[K, O]` for the frame that begins."""
    at = world.scales.offset
    for k in range(world.agents.role.shape[0]):
        out = world.players.observation[k]
        _observe_own(world, k, out)
        if at[POSES] >= 0:
            _observe_poses(world, out)
        if at[PICTURE] >= 0:
            _observe_picture(world, out)
        if at[TRACKS] >= 0:
            _observe_tracks(world, out)
        if at[SHARED_DETECTIONS] >= 0:
            _observe_shared(world, k, out)


@kernel
def _observe_own(world, k, out):
    at, agents, raw, reports = world.scales.offset, world.agents, world.raw, world.reports
    out[at[ROLE]] = agents.role[k]
    out[at[TIME]] = _clip(world.clock.frame / max(1, world.parameters.horizon))
    _write_pose(world, k, out, at[POSE])
    pose, reach = agents.pose[k], REACH * agents.fov_radius[k]
    _write_points(raw.detections[k], raw.count[k], pose, reach, out, at[DETECTIONS], at[DETECTIONS_MASK])
    _write_points(reports.detections[k], reports.count[k], pose, reach, out, at[REPORT], at[REPORT_MASK])


@kernel
def _write_pose(world, k, out, at):
    _write_place(world, world.agents.pose[k], out, at)
    heading = world.agents.pose[k, 2]
    out[at + 2], out[at + 3] = _clip(math.cos(heading)), _clip(math.sin(heading))


@inlined
def _write_place(world, point, out, at):
    """A position, scaled to the extent."""
    scales = world.scales
    out[at] = _clip((point[0] - scales.centre[0]) / scales.half)
    out[at + 1] = _clip((point[1] - scales.centre[1]) / scales.half)


@kernel
def _write_points(points, count, centre, scale, out, at, mask):
    """Points `[D, 2]` relative to a centre, and their mask; zeros beyond `count`."""
    for d in range(points.shape[0]):
        there = d < count
        out[at + 2 * d] = _clip((points[d, 0] - centre[0]) / scale) if there else np.float32(0.0)
        out[at + 2 * d + 1] = _clip((points[d, 1] - centre[1]) / scale) if there else np.float32(0.0)
        out[mask + d] = _flag(there)


@kernel
def _observe_poses(world, out):
    at, agents = world.scales.offset, world.agents
    for k in range(agents.role.shape[0]):
        _write_pose(world, k, out, at[POSES] + 4 * k)
        fov = at[FOVS] + 3 * k
        out[fov] = _clip(agents.fov_radius[k] / world.scales.half)
        out[fov + 1] = _clip(agents.fov_half_width[k] / math.pi)
        out[fov + 2] = _clip(agents.fov_heading[k] / math.pi)


@kernel
def _write_track(world, j, out, at):
    mean, speed = world.tracks.mean[j], world.scales.speed
    _write_place(world, mean, out, at)
    out[at + 2], out[at + 3] = _clip(mean[2] / speed), _clip(mean[3] / speed)


@kernel
def _observe_picture(world, out):
    at, published, shown = world.scales.offset, world.picture.published, 0
    for j in range(world.tracks.count):
        if published[j]:
            _write_track(world, j, out, at[PICTURE] + 4 * shown)
            shown += 1
    for j in range(published.shape[0]):
        out[at[PICTURE_MASK] + j] = _flag(j < shown)
        if j >= shown:
            for axis in range(4):
                out[at[PICTURE] + 4 * j + axis] = np.float32(0.0)


@kernel
def _write_trust(mean, variance, out, at):
    opinion = not math.isnan(mean)
    out[at] = _clip(mean) if opinion else np.float32(-1.0)
    out[at + 1] = _clip(variance) if opinion else np.float32(-1.0)


@kernel
def _observe_tracks(world, out):
    at, tracks, verdict = world.scales.offset, world.tracks, world.verdict
    for j in range(tracks.status.shape[0]):
        if j < tracks.count and tracks.status[j] != 0:
            _write_track(world, j, out, at[TRACKS] + 4 * j)
            out[at[TRACKS_STATUS] + j] = np.float32(1.0 if tracks.status[j] == CONFIRMED else 0.5)
            out[at[TRACKS_SCORE] + j] = _clip(tracks.score[j] / SCORE_SCALE)
            _write_trust(verdict.track_trust[j], verdict.track_trust_var[j], out, at[TRACKS_TRUST] + 2 * j)
        else:
            for axis in range(4):
                out[at[TRACKS] + 4 * j + axis] = np.float32(0.0)
            out[at[TRACKS_STATUS] + j], out[at[TRACKS_SCORE] + j] = np.float32(0.0), np.float32(0.0)
            _write_trust(np.nan, np.nan, out, at[TRACKS_TRUST] + 2 * j)
    for k in range(world.agents.role.shape[0]):
        _write_trust(verdict.agent_trust[k], verdict.agent_trust_var[k], out, at[AGENTS_TRUST] + 2 * k)


@kernel
def _observe_shared(world, k, out):
    """Detections and reports of the other adversaries, for an adversary."""
    at, role, raw, reports = world.scales.offset, world.agents.role, world.raw, world.reports
    centre, half, slots = world.scales.centre, world.scales.half, raw.detections.shape[1]
    for other in range(role.shape[0]):
        allies = role[k] > 0 and role[other] > 0 and other != k
        seen, reported = raw.count[other] if allies else 0, reports.count[other] if allies else 0
        points, mask = at[SHARED_DETECTIONS] + 2 * slots * other, at[SHARED_DETECTIONS_MASK] + slots * other
        _write_points(raw.detections[other], seen, centre, half, out, points, mask)
        points, mask = at[SHARED_REPORTS] + 2 * slots * other, at[SHARED_REPORTS_MASK] + slots * other
        _write_points(reports.detections[other], reported, centre, half, out, points, mask)
