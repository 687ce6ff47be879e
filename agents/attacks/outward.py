"""Phantoms on the rim of the own FOV, away from everybody else."""

from __future__ import annotations

from typing import Any

import numpy as np

from trust_env.agents.attacks.phantoms import Phantoms
from trust_env.agents.base import PolicyContext
from trust_env.agents.parameters import angle
from trust_env.agents.search_ranges import Range, SearchRanges
from trust_env.scenario import Scenario
from trust_env.scenario.fov.shape import INSIDE

_HALVINGS = 48  # of twice an FOV's reach, until the rim is found to within rounding


class Outward(Phantoms):
    """False positives of every adversary on its FOV's rim, on the side away from the middle of the area.

    There few others look, and nobody has to tell it so. Phantom i of n stands in the direction of the outward
    bearing + spread (i - (n - 1) / 2). It withholds all own detections unless told otherwise.

    spread       rad, between neighbouring phantoms; 0: all at one place
    """

    name = "outward"

    def __init__(
        self,
        spread: float = 0.1,
        n: int | None = None,
        motion: str = "static",
        speed: float | None = None,
        noise: float | None = 0.0,
        hit_rate: float | None = None,
        start: int = 0,
        suppress: float = 1.0,
    ):
        super().__init__(n, False, motion, speed, noise, hit_rate, start, suppress)
        self.spread = angle(self.name, "spread", spread)

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        return {"spread": Range(0.0, 1.0), **super().search_ranges(scenario, **given)}

    def prepare(self, context: PolicyContext) -> None:
        super().prepare(context)
        x0, x1, y0, y1 = context.scenario.area
        self._middle = np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1)])
        reaches = [context.scenario.agent(int(k)).fov.reach for k in context.agents]
        self._reach = np.array(reaches)[:, None]  # [n, 1], m

    def place(self, rows: np.ndarray, seen: dict[str, np.ndarray]) -> None:
        self.position[rows] = self._rim(seen["pose"])
        self.reports[rows] = np.arange(self._count) < self.budgets()[:, None]
        if self.is_moving:
            self.velocity[rows] = self.draw_velocities(rows)

    def replace(self, seen: dict[str, np.ndarray], left: np.ndarray, before: np.ndarray) -> None:
        self.position = np.where(left[..., None], self._rim(seen["pose"]), self.position)
        self.velocity = np.where(left[..., None], self.draw_velocities(slice(None)), self.velocity)

    def _rim(self, pose: np.ndarray) -> np.ndarray:
        """The phantoms' places [w, n, P, 2] (m), by halving the way from the middle of the FOV to beyond it."""
        out = pose[..., :2] - self._middle
        bearing = np.arctan2(np.ascontiguousarray(out[..., 1]), np.ascontiguousarray(out[..., 0]))
        fan = self.spread * (np.arange(self._count) - 0.5 * (self._count - 1))
        angles = bearing[..., None] + fan
        ahead = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        start = self.fovs.middles(pose)[..., None, :]
        inside, outside = np.zeros(angles.shape), np.broadcast_to(2.0 * self._reach, angles.shape)
        for _ in range(_HALVINGS):
            half = 0.5 * (inside + outside)
            held = self.fovs.contains(pose, start + half[..., None] * ahead)
            inside, outside = np.where(held, half, inside), np.where(held, outside, half)
        return start + INSIDE * inside[..., None] * ahead
