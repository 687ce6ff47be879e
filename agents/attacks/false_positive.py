"""False positives at random places in the own FOV: all along, or in a burst."""

from __future__ import annotations

from typing import Any

import numpy as np

from trust_env.agents.attacks.motion import drawn_velocities
from trust_env.agents.attacks.phantoms import Phantoms
from trust_env.agents.attacks.placed_phantoms import PlacedPhantoms
from trust_env.agents.base import PLACE, PolicyContext
from trust_env.agents.parameters import whole_number
from trust_env.agents.search_ranges import Range, SearchRanges, half_episode
from trust_env.scenario import Scenario


class RandomPhantoms(PlacedPhantoms):
    """Phantoms at random places, drawn anew where one has left the FOV."""

    def zone(self, seen: dict[str, np.ndarray], points: np.ndarray, rows: np.ndarray | slice) -> np.ndarray:
        return Phantoms.zone(self, seen, points, rows)  # all places cost the same

    def place(self, rows: np.ndarray, seen: dict[str, np.ndarray]) -> None:
        if self.is_shared:
            super().place(rows, seen)
            return
        self.position[rows], self.velocity[rows] = self._draw_phantoms(rows, seen["pose"])
        self.reports[rows] = np.arange(self._count) < self.budgets()[:, None]

    def replace(self, seen: dict[str, np.ndarray], left: np.ndarray, before: np.ndarray) -> None:
        if self.is_shared:
            super().replace(seen, left, before)
            return
        position, velocity = self._draw_phantoms(slice(None), seen["pose"])
        self.position = np.where(left[..., None], position, self.position)
        self.velocity = np.where(left[..., None], velocity, self.velocity)

    def _draw_phantoms(self, rows: np.ndarray | slice, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions uniform in the FOVs, velocities of uniform direction, for a phantom in every slot."""
        draws = self.draw(PLACE, 5 * self._count, rows)
        draws = draws.reshape(*draws.shape[:2], self._count, 5)
        return self.fovs.sample(pose, draws[..., :3]), drawn_velocities(draws[..., 3:], self.speeds())


class FalsePositive(RandomPhantoms):
    """False positives at random places in the own FOV, which then stay, move straight on, or wander.

    A phantom that would leave the FOV is replaced by a new one (constant_velocity), stays where it is for
    a frame (random_walk), or turns (pace). Where the scenario lists injections, those of the own agents are
    replayed in place of phantoms, and n, share, motion, speed and noise do not apply.

    period       frames from one report of a phantom to the next
    """

    name = "false_positive"

    def __init__(
        self,
        n: int | None = None,
        motion: str = "static",
        speed: float | None = None,
        start: int = 0,
        period: int = 1,
        hit_rate: float | None = None,
        share: bool = False,
        noise: float | None = None,
        suppress: float = 0.0,
    ):
        super().__init__(n, share, motion, speed, noise, hit_rate, start, suppress)
        self.period = whole_number(self.name, "period", period, 1)

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        return {**super().search_ranges(scenario, **given), "period": Range(1, 5, whole=True)}

    @property
    def is_shared(self) -> bool:
        return self.share and self._listed is None

    @property
    def is_moving(self) -> bool:
        return super().is_moving and self._listed is None

    def prepare(self, context: PolicyContext) -> None:
        listed = [[c.position for c in context.scenario.injections if c.agent == k] for k in context.agents]
        self._listed = listed if context.scenario.injections else None
        super().prepare(context)
        if self._listed is not None:
            self._noise[...], self._asked = 0.0, sum(map(len, self._listed))

    def count(self, slots: int, agents: int) -> int:
        return super().count(slots, agents) if self._listed is None else max(map(len, self._listed))

    def place(self, rows: np.ndarray, seen: dict[str, np.ndarray]) -> None:
        if self._listed is None:
            super().place(rows, seen)
            return
        for i, own in enumerate(self._listed):
            self.reports[rows, i] = np.arange(self._count) < len(own)
            self.position[rows, i, : len(own)] = np.array(own).reshape(-1, 2)

    def reporting(self) -> np.ndarray:
        return self.active() & ((self.frame - self.start) % self.period == 0)


class Burst(RandomPhantoms):
    """False positives at random places in the own FOV for some frames, then silence.

    Tracks are confirmed and then coast until enough misses delete them.

    frames       of the burst
    """

    name = "burst"

    def __init__(
        self,
        frames: int = 10,
        n: int | None = None,
        share: bool = False,
        motion: str = "static",
        speed: float | None = None,
        noise: float | None = None,
        hit_rate: float | None = None,
        start: int = 0,
        suppress: float = 0.0,
    ):
        super().__init__(n, share, motion, speed, noise, hit_rate, start, suppress)
        self.frames = whole_number(self.name, "frames", frames, 1)

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        return {"frames": Range(1, half_episode(scenario), whole=True), **super().search_ranges(scenario, **given)}

    def active(self) -> np.ndarray:
        return (self.frame >= self.start) & (self.frame < self.start + self.frames)
