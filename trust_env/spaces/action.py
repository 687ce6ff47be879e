"""Actions: one table, the space, and the way from metres to an action.

`Box(-1, 1, (3M + D,))`: per injection slot `[fire, x, y]`, fired when `fire > 0`, x and y over the bounding
box of the agent's FOV; then one entry per own detection slot, suppressed when > 0. The zero vector does
nothing. Entries beyond an agent's budget have no effect.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from trust_env.scenario import Scenario

SLOT = ("fire", "x", "y")  # the entries of an injection slot


class ActionTable(Mapping[str, slice]):
    """Where injections `[M, 3]` and suppressions `[D]` stand in an action; `size` is its length A."""

    def __init__(self, scenario: Scenario):
        self.slots, self.detections = scenario.injection.slots, scenario.sensor.max_detections
        injections = len(SLOT) * self.slots
        self._slices = {
            "injections": slice(0, injections),
            "suppressions": slice(injections, injections + self.detections),
        }
        self.size = injections + self.detections

    def __getitem__(self, name: str) -> slice:
        return self._slices[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._slices)

    def __len__(self) -> int:
        return len(self._slices)

    def parameters(self) -> dict[str, int]:
        """What the kernels know of it."""
        slots, suppressions = self["injections"].start, self["suppressions"].start
        return {"slots_at": slots, "slot_length": len(SLOT), "suppressions_at": suppressions}

    def injections(self, actions: np.ndarray) -> np.ndarray:
        """The injection slots [..., M, 3] of actions[..., A]; a view."""
        slots = actions[..., self["injections"]]
        return slots.reshape(*slots.shape[:-1], self.slots, len(SLOT))

    def zero_actions(self, *shape: int) -> np.ndarray:
        """The honest action, float32[*shape, A]: zeros."""
        return np.zeros((*shape, self.size), dtype=np.float32)

    def encode(self, fov_box, positions=None, fire=None, suppress=None) -> np.ndarray:
        """Actions float32[..., A] from metres.

        fov_box[..., 4]: x_min, x_max, y_min, y_max of the agent's FOV (`arrays.fov_box`); positions[..., n, 2]
        (m) fill the first n injection slots, fired where fire[..., n] (default: all); suppress bool[..., D].
        """
        box = np.asarray(fov_box, dtype=np.float64)
        out = self.zero_actions(*box.shape[:-1])
        if positions is not None:
            points = np.asarray(positions, dtype=np.float64)
            n = min(points.shape[-2], self.slots)
            low, high = box[..., None, 0::2], box[..., None, 1::2]
            slots = self.injections(out).copy()
            slots[..., :n, 0] = 1.0 if fire is None else np.where(np.asarray(fire)[..., :n], 1.0, -1.0)
            extent = np.maximum(high - low, np.finfo(np.float64).tiny)  # 0 where rounding leaves nothing of a thin FOV
            slots[..., :n, 1:] = np.clip(2.0 * (points[..., :n, :] - low) / extent - 1.0, -1.0, 1.0)
            out[..., self["injections"]] = slots.reshape(*box.shape[:-1], -1)
        if suppress is not None:
            out[..., self["suppressions"]] = np.asarray(suppress, dtype=np.float32)
        return out
