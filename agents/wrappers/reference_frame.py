"""The reference frame that a learner sees and acts in. Points are complex numbers, x + iy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from trust_env.agents.base import PolicyContext
from trust_env.agents.wrappers.wrapper import merge_adjacent
from trust_env.scenario import Fovs
from trust_env.spaces.observation import REACH

Points: TypeAlias = np.ndarray[tuple[int, ...], np.dtype[np.complex64]]

AREA, OUTWARD = KINDS = ("area", "outward")
PAIRS = frozenset(  # fields that are made of pairs: x and y, vx and vy, cos and sin
    ["pose", "detections", "report", "poses", "picture", "tracks", "shared_detections", "shared_reports"]
)
_TINY = np.float32(1e-30)  # no division by 0


class ReferenceFrame:
    """Points relative to each learner, in REACH radii of its FOV, as observations scale own detections.

    kind: `area`, the axes are the area's; or `outward`, the x axis points from the middle of the area to the
    learner. There what was learned on one side of the area holds on all sides.
    """

    axis: Points  # [W, n, 1], direction of the x axis; [1, 1, 1] where it is the area's

    def __init__(self, kind: str, context: PolicyContext, fields: Mapping[str, int]):
        self._outward, table = kind == OUTWARD, context.observation_table
        self._detections, self._pose = table["detections"].slice, table["pose"].slice
        self._fovs = Fovs.of(context.scenario, context.agents)
        self._reach = table.scales.reach[context.agents][:, None]
        fovs = [context.scenario.agent(int(k)).fov for k in context.agents]
        self._boxes_turn = any(not fov.shape.is_round for fov in fovs)  # with the agent's heading
        ends = np.cumsum(list(fields.values()))
        slices = {name: slice(end - fields[name], end) for name, end in zip(fields, ends)}
        self._pairs = merge_adjacent(slices[name] for name in fields if name in PAIRS)
        self.axis = np.ones((1, 1, 1), dtype=np.complex64)
        self._set_boxes(np.tile([0.0, 0.0, 1.0, 0.0], (len(context.agents), 1)))

    def set_poses(self, observations: np.ndarray) -> None:
        """Take the learners' poses of the present frame from observations[W, n, O]."""
        if self._outward:
            self.axis = self._outward_axis(observations)
        if self._boxes_turn:
            self._set_boxes(observations[..., self._pose] * np.array([0.0, 0.0, 1.0, 1.0]))

    def _outward_axis(self, observations: np.ndarray) -> Points:
        """Directions [W, n, 1] of length 1 from the middle of the area to the learners."""
        pose = observations[..., self._pose]
        off = pose[..., 0:1] + 1j * pose[..., 1:2]
        length = np.abs(off)
        return np.where(length > 0.0, off / np.maximum(length, _TINY), np.complex64(1.0))

    def _set_boxes(self, pose: np.ndarray) -> None:
        """Middle and half size [..., n, 1] of the FOVs' boxes at pose[..., n, 4]."""
        box = self._fovs.boxes(pose) / self._reach
        low, high = box[..., 0] + 1j * box[..., 2], box[..., 1] + 1j * box[..., 3]
        self._middle: Points = ((low + high) / 2).astype(np.complex64)[..., None]
        self._half: Points = ((high - low) / 2).astype(np.complex64)[..., None]

    def rotate_fields(self, seen: np.ndarray, observations: np.ndarray) -> None:
        """Rotate into this reference frame the fields that seen[W, n, O'] begins with, in place."""
        if self._outward:
            back = np.conj(self._outward_axis(observations))
            for field in self._pairs:
                pairs = seen[..., field]
                pairs.view(np.complex64)[...] *= back
                np.clip(pairs, -1.0, 1.0, out=pairs)

    def detections(self, observations: np.ndarray) -> Points:
        """Own detections [W, n, D], 0 where there is none; after `set_poses`."""
        points = np.ascontiguousarray(observations[..., self._detections]).view(np.complex64)
        return points * np.conj(self.axis)

    def to_raw_action(self, points: Points) -> tuple[np.ndarray, np.ndarray]:
        """x and y of raw actions that inject at points[W, n, P]; after `set_poses`."""
        off = points * self.axis - self._middle
        return off.real / self._half.real, off.imag / self._half.imag


def clip_to_fov(radii: np.ndarray) -> Points:
    """Points from points in radii of the FOV; those beyond its edge are moved to it."""
    points: Any = radii / (np.float32(REACH) * np.maximum(np.float32(1.0), np.abs(radii)))
    return points
