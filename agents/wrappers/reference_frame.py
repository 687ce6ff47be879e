"""The frame of reference that a learner sees and acts in. Places are complex numbers, x + iy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from trust_env.agents.base import PolicyContext
from trust_env.agents.wrappers.wrapper import joined
from trust_env.scenario import Fovs
from trust_env.spaces.observation import REACH

Places: TypeAlias = np.ndarray[tuple[int, ...], np.dtype[np.complex64]]

AREA, OUTWARD = KINDS = ("area", "outward")
PAIRS = frozenset(  # fields that are made of pairs: x and y, vx and vy, cos and sin
    ["pose", "detections", "report", "poses", "picture", "tracks", "shared_detections", "shared_reports"]
)
_TINY = np.float32(1e-30)  # no division by 0


class Frame:
    """Places about each learner, in REACH radii of its FOV, as observations scale what is its own.

    kind: `area`, the axes are the area's; or `outward`, the x axis points from the middle of the area to the
    learner. In that frame what was learned on one side of the area serves on all.
    """

    def __init__(self, kind: str, context: PolicyContext, fields: Mapping[str, int]):
        self._outward, table = kind == OUTWARD, context.observation_table
        self._detections, self._pose = table["detections"].slice, table["pose"].slice
        self._fovs = Fovs.of(context.scenario, context.agents)
        self._reach = table.scales.reach[context.agents][:, None]
        self._turns = any(context.scenario.agent(int(k)).fov.type != "circle" for k in context.agents)
        ends = np.cumsum(list(fields.values()))
        self._pairs = joined(slice(e - fields[name], e) for name, e in zip(fields, ends) if name in PAIRS)
        self._axis: Places = np.ones((1, 1, 1), dtype=np.complex64)  # [W, n, 1], direction of the x axis
        self._face(np.tile([0.0, 0.0, 1.0, 0.0], (len(context.agents), 1)))

    def look(self, observations: np.ndarray) -> None:
        """Where the learners stand, on observations[W, n, O]."""
        if self._outward:
            self._axis = self._away(observations)
        if self._turns:  # circles are the same however one turns
            self._face(observations[..., self._pose] * np.array([0.0, 0.0, 1.0, 1.0]))

    def _away(self, observations: np.ndarray) -> Places:
        """Directions [W, n, 1] of length 1 from the middle of the area to the learners."""
        pose = observations[..., self._pose]
        way = pose[..., 0:1] + 1j * pose[..., 1:2]
        length = np.abs(way)
        return np.where(length > 0.0, way / np.maximum(length, _TINY), np.complex64(1.0))

    def _face(self, pose: np.ndarray) -> None:
        """Middle and half size [..., n, 1] of the FOVs' boxes at pose[..., n, 4]."""
        box = self._fovs.boxes(pose) / self._reach
        low, high = box[..., 0] + 1j * box[..., 2], box[..., 1] + 1j * box[..., 3]
        self._middle: Places = ((low + high) / 2).astype(np.complex64)[..., None]
        self._half: Places = ((high - low) / 2).astype(np.complex64)[..., None]

    def turn(self, seen: np.ndarray, observations: np.ndarray) -> None:
        """Express in this frame the fields that seen[W, n, O'] begins with, of observations[W, n, O]."""
        if self._outward:
            back = np.conj(self._away(observations))
            for stretch in self._pairs:
                pairs = seen[..., stretch]
                pairs.view(np.complex64)[...] *= back
                np.clip(pairs, -1.0, 1.0, out=pairs)

    def detections(self, observations: np.ndarray) -> Places:
        """Own detections [W, n, D], 0 where there is none; after `look`."""
        points = np.ascontiguousarray(observations[..., self._detections]).view(np.complex64)
        return points * np.conj(self._axis)

    def raw(self, places: Places) -> tuple[np.ndarray, np.ndarray]:
        """x and y of raw actions that inject at places[W, n, P]; after `look`."""
        off = places * self._axis - self._middle
        return off.real / self._half.real, off.imag / self._half.imag


def over_fov(radii: np.ndarray) -> Places:
    """Places for places in radii of the FOV; those beyond its edge are moved to it."""
    places: Any = radii / (np.float32(REACH) * np.maximum(np.float32(1.0), np.abs(radii)))
    return places
