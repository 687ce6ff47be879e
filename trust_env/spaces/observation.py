"""What agents observe: one table of fields, from which the space, the slices, the kernel's offsets and the
documentation are made.

All entries are float32 in [-1, 1]. Positions are scaled either to the agent's own FOV (relative to the agent,
1.25 radii = 1) or to the scenario's extent.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from trust_env.compiled.jit import compiled, inlined
from trust_env.world.fields import (
    F,
    flags1,
    floats1,
    floats2,
    floats3,
    ints1,
    real,
    shape0,
    shape1,
    singles2,
    whole,
)
from trust_env.world.tracking.score import CONFIRMED

if TYPE_CHECKING:
    from trust_env.scenario import Scenario

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

    def read(self, observation: np.ndarray, agents: np.ndarray | list[int] | int) -> dict[str, np.ndarray]:
        """The fields of `observation[..., O]` in metres and m/s (float64), masks as booleans.

        `agents`: the agents' indices, to be broadcast against the leading axes of `observation` (their FOVs
        scale what is relative).
        """
        raw = {
            f.name: observation[..., f.slice].reshape((*observation.shape[:-1], *f.shape)).astype(np.float64)
            for f in self.values()
        }
        scales = self.scales
        reach = scales.reach[np.asarray(agents)][..., None, None]
        out = {name: values > 0.5 if name.endswith("mask") else values for name, values in raw.items()}
        place = raw["pose"][..., :2] * scales.half + scales.centre
        out["role"], out["time"] = (
            raw["role"].reshape(observation.shape[:-1]),
            raw["time"].reshape(observation.shape[:-1]),
        )
        out["pose"] = np.concatenate([place, raw["pose"][..., 2:]], axis=-1)
        for name in ("detections", "report"):
            out[name] = raw[name] * reach + place[..., None, :]
        for name in ("poses", "picture", "tracks"):
            if name in raw:
                rest = raw[name][..., 2:] * (1.0 if name == "poses" else scales.speed)
                out[name] = np.concatenate([raw[name][..., :2] * scales.half + scales.centre, rest], axis=-1)
        for name in ("shared_detections", "shared_reports"):
            if name in raw:
                out[name] = raw[name] * scales.half + scales.centre
        if "fovs" in raw:
            out["fovs"] = raw["fovs"] * np.array([scales.half, math.pi, math.pi])
        if "tracks_score" in raw:
            out["tracks_score"] = raw["tracks_score"] * SCORE_SCALE
        return out

    def markdown(self) -> str:
        """The table as documentation."""
        rows = ["| field | entries | shape | meaning and scaling |", "| --- | --- | --- | --- |"]
        rows += [
            f"| `{f.name}` | {f.slice.start}:{f.slice.stop} | {list(f.shape)} | {f.unit} |"
            for f in self.values()
        ]
        return "\n".join(rows)


# --- kernels ------------------------------------------------------------------------------------------------
# ------------------


@inlined
def _clip(value):
    return np.float32(min(1.0, max(-1.0, value)))


@compiled
def observe(world):
    """Fill `observation[K, O]` for the frame that begins."""
    at = ints1(world, F.observation_offset)
    for k in range(shape0(world, F.pose)):
        out = singles2(world, F.observation)[k]
        _observe_own(world, k, out, at)
        if at[POSES] >= 0:
            _observe_poses(world, out, at)
        if at[PICTURE] >= 0:
            _observe_picture(world, out, at)
        if at[TRACKS] >= 0:
            _observe_tracks(world, out, at)
        if at[SHARED_DETECTIONS] >= 0:
            _observe_shared(world, k, out, at)


@compiled
def _observe_own(world, k, out, at):
    horizon = max(1, whole(world, F.horizon))
    out[at[ROLE]] = ints1(world, F.role)[k]
    out[at[TIME]] = _clip(whole(world, F.frame) / horizon)
    _write_pose(world, k, out, at[POSE])
    reach = REACH * floats1(world, F.fov_radius)[k]
    pose = floats2(world, F.pose)[k]
    raw, raw_count = floats3(world, F.raw_detections)[k], ints1(world, F.raw_count)[k]
    _write_points(raw, raw_count, pose, reach, out, at[DETECTIONS], at[DETECTIONS_MASK])
    report, report_count = floats3(world, F.reports)[k], ints1(world, F.report_count)[k]
    _write_points(report, report_count, pose, reach, out, at[REPORT], at[REPORT_MASK])


@compiled
def _write_pose(world, k, out, at):
    pose, centre, half = (
        floats2(world, F.pose)[k],
        floats1(world, F.extent_centre),
        real(world, F.extent_half),
    )
    out[at], out[at + 1] = _clip((pose[0] - centre[0]) / half), _clip((pose[1] - centre[1]) / half)
    out[at + 2], out[at + 3] = _clip(math.cos(pose[2])), _clip(math.sin(pose[2]))


@compiled
def _write_points(points, count, centre, scale, out, at, mask):
    """Points `[D, 2]` relative to a centre, and their mask; zeros beyond `count`."""
    for d in range(points.shape[0]):
        there = d < count
        out[at + 2 * d] = _clip((points[d, 0] - centre[0]) / scale) if there else np.float32(0.0)
        out[at + 2 * d + 1] = _clip((points[d, 1] - centre[1]) / scale) if there else np.float32(0.0)
        out[mask + d] = np.float32(1.0) if there else np.float32(0.0)


@compiled
def _observe_poses(world, out, at):
    half = real(world, F.extent_half)
    for k in range(shape0(world, F.pose)):
        _write_pose(world, k, out, at[POSES] + 4 * k)
        fov = at[FOVS] + 3 * k
        out[fov] = _clip(floats1(world, F.fov_radius)[k] / half)
        out[fov + 1] = _clip(floats1(world, F.fov_half_width)[k] / math.pi)
        out[fov + 2] = _clip(floats1(world, F.fov_heading)[k] / math.pi)


@compiled
def _write_track(world, j, out, at):
    mean, centre = floats2(world, F.track_mean)[j], floats1(world, F.extent_centre)
    half, speed = real(world, F.extent_half), real(world, F.speed_scale)
    out[at], out[at + 1] = _clip((mean[0] - centre[0]) / half), _clip((mean[1] - centre[1]) / half)
    out[at + 2], out[at + 3] = _clip(mean[2] / speed), _clip(mean[3] / speed)


@compiled
def _observe_picture(world, out, at):
    published, shown = flags1(world, F.published), 0
    for j in range(whole(world, F.columns)):
        if published[j]:
            _write_track(world, j, out, at[PICTURE] + 4 * shown)
            shown += 1
    for j in range(published.shape[0]):
        out[at[PICTURE_MASK] + j] = np.float32(1.0) if j < shown else np.float32(0.0)
        if j >= shown:
            for axis in range(4):
                out[at[PICTURE] + 4 * j + axis] = np.float32(0.0)


@compiled
def _write_trust(mean, variance, out, at):
    opinion = not math.isnan(mean)
    out[at] = _clip(mean) if opinion else np.float32(-1.0)
    out[at + 1] = _clip(variance) if opinion else np.float32(-1.0)


@compiled
def _observe_tracks(world, out, at):
    status = ints1(world, F.track_status)
    for j in range(status.shape[0]):
        there = j < whole(world, F.columns) and status[j] != 0
        if there:
            _write_track(world, j, out, at[TRACKS] + 4 * j)
            out[at[TRACKS_STATUS] + j] = np.float32(1.0) if status[j] == CONFIRMED else np.float32(0.5)
            out[at[TRACKS_SCORE] + j] = _clip(floats1(world, F.track_score)[j] / SCORE_SCALE)
            _write_trust(
                floats1(world, F.track_trust)[j],
                floats1(world, F.track_trust_var)[j],
                out,
                at[TRACKS_TRUST] + 2 * j,
            )
        else:
            for axis in range(4):
                out[at[TRACKS] + 4 * j + axis] = np.float32(0.0)
            out[at[TRACKS_STATUS] + j], out[at[TRACKS_SCORE] + j] = np.float32(0.0), np.float32(0.0)
            _write_trust(np.nan, np.nan, out, at[TRACKS_TRUST] + 2 * j)
    for k in range(shape0(world, F.pose)):
        _write_trust(
            floats1(world, F.agent_trust)[k],
            floats1(world, F.agent_trust_var)[k],
            out,
            at[AGENTS_TRUST] + 2 * k,
        )


@compiled
def _observe_shared(world, k, out, at):
    """Detections and reports of the other adversaries, for an adversary."""
    centre, half, role = floats1(world, F.extent_centre), real(world, F.extent_half), ints1(world, F.role)
    slots = shape1(world, F.raw_origin)
    for other in range(role.shape[0]):
        allies = role[k] > 0 and role[other] > 0 and other != k
        raw_count = ints1(world, F.raw_count)[other] if allies else 0
        report_count = ints1(world, F.report_count)[other] if allies else 0
        first, mask = 2 * slots * other, slots * other
        _write_points(
            floats3(world, F.raw_detections)[other],
            raw_count,
            centre,
            half,
            out,
            at[SHARED_DETECTIONS] + first,
            at[SHARED_DETECTIONS_MASK] + mask,
        )
        _write_points(
            floats3(world, F.reports)[other],
            report_count,
            centre,
            half,
            out,
            at[SHARED_REPORTS] + first,
            at[SHARED_REPORTS_MASK] + mask,
        )
