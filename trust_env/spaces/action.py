"""Actions: one table, the spaces, and the way from metres to an action.

`Box(-1, 1, (3M + D,))`: per injection slot `[fire, x, y]`, fired when `fire > 0`, x and y over the bounding
box of the agent's FOV; then one entry per own detection slot, suppressed when > 0. The zero vector does
nothing. Entries beyond an agent's budget have no effect.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from trust_env.scenario import Scenario


def action_table(scenario: Scenario) -> dict[str, slice]:
    """Where injections `[3M]` and suppressions `[D]` stand in an action."""
    injections = 3 * scenario.injection.slots
    return {
        "injections": slice(0, injections),
        "suppressions": slice(injections, injections + scenario.sensor.max_detections),
    }


def encode_action(scenario: Scenario, fov_box, positions=None, fire=None, suppress=None) -> np.ndarray:
    """Actions float32[..., A] from metres.

    fov_box[..., 4]: x_min, x_max, y_min, y_max of the agent's FOV (`arrays.fov_box`, or `fov_box` below);
    positions[..., n, 2] (m) fill the first n injection slots, fired where fire[..., n] (default: all);
    suppress bool[..., D].
    """
    table, box = action_table(scenario), np.asarray(fov_box, dtype=np.float64)
    out = np.zeros((*box.shape[:-1], table["suppressions"].stop), dtype=np.float32)
    if positions is not None:
        points = np.asarray(positions, dtype=np.float64)
        n = min(points.shape[-2], scenario.injection.slots)
        low, high = box[..., None, 0::2], box[..., None, 1::2]
        slots = out[..., table["injections"]].reshape(*box.shape[:-1], -1, 3)
        slots[..., :n, 0] = 1.0 if fire is None else np.where(np.asarray(fire)[..., :n], 1.0, -1.0)
        slots[..., :n, 1:] = np.clip(2.0 * (points[..., :n, :] - low) / (high - low) - 1.0, -1.0, 1.0)
        out[..., table["injections"]] = slots.reshape(*box.shape[:-1], -1)
    if suppress is not None:
        out[..., table["suppressions"]] = np.asarray(suppress, dtype=np.float32)
    return out
