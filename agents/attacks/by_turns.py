"""More phantoms than slots: each is reported only as often as its track needs to live."""

from __future__ import annotations

from typing import Any

import numpy as np

from trust_env.agents.attacks.unseen_false_positives import Lonely
from trust_env.agents.base import PolicyContext
from trust_env.agents.parameters import non_negative_or_none, whole_number
from trust_env.agents.search_ranges import Range, SearchRanges, noise_deviation
from trust_env.agents.track_forecast import TrackForecast
from trust_env.scenario import Scenario

SPACING = 10.0  # between phantoms, in standard deviations of the sensors' noise


class ByTurns(Lonely):
    """More phantoms than slots, reported by turns where no honest agent looks and few adversaries do.

    A hit gains a track more than a few misses cost it, so that a confirmed one lives on a report every few
    frames. Each adversary forecasts its phantoms' scores as the centre's tracker would keep them, and reports
    the most urgent: first confirmed ones that are about to be deleted, then those nearest to confirmation.

    per_slot     phantoms of each adversary for every injection that its budget allows
    spacing      m, least distance between phantoms, where there is room; None: ten deviations of the noise
    """

    name = "by_turns"

    def __init__(
        self,
        per_slot: int = 3,
        spacing: float | None = None,
        motion: str = "static",
        speed: float | None = None,
        noise: float | None = 0.0,
        hit_rate: float | None = None,
        start: int = 0,
        suppress: float = 0.0,
    ):
        super().__init__(None, False, motion, speed, noise, hit_rate, start, suppress)
        self.per_slot = whole_number(self.name, "per_slot", per_slot, 1)
        self.spacing = non_negative_or_none(self.name, "spacing", spacing, "m", "ten deviations of the noise")

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        usual = SPACING * noise_deviation(scenario)
        own = {"per_slot": Range(1, 5, whole=True), "spacing": Range(0.0, 2.0 * usual, none=usual)}
        return {**own, **super().search_ranges(scenario, **given)}

    def prepare(self, context: PolicyContext) -> None:
        super().prepare(context)
        self.least_distance = SPACING * noise_deviation(context.scenario) if self.spacing is None else self.spacing
        self.forecast = TrackForecast(context.scenario, context.agents, self.reports.shape)
        self._watchers = np.zeros(self.reports.shape, dtype=np.int64)  # [W, n, P], adversaries that look

    def count(self, slots: int, agents: int) -> int:
        return self.per_slot * super().count(slots, agents)

    def budgets(self) -> np.ndarray:
        return self.per_slot * self.injections

    def place(self, rows: np.ndarray, seen: dict[str, np.ndarray]) -> None:
        super().place(rows, seen)
        self.forecast.clear(rows)
        self._watch(rows, seen)

    def _watch(self, rows: np.ndarray | slice, seen: dict[str, np.ndarray]) -> None:
        self._watchers[rows] = self.count_watchers(seen, self.position[rows])

    def due(self, seen: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        if self.is_moving:
            self._watch(slice(None), seen)
        slots = self._in_budget.sum(axis=1)[:, None]
        urgency = self.forecast.urgency(self.reports, self._watchers, slots)
        phantom = np.argsort(-urgency, axis=2, kind="stable")[..., : self._phantom.shape[2]]
        return phantom, np.take_along_axis(self.reports, phantom, axis=2)

    def remember(self, phantom: np.ndarray, fire: np.ndarray, points: np.ndarray) -> None:
        hit, where = np.zeros(self.reports.shape, dtype=bool), np.zeros((*self.reports.shape, 2))
        np.put_along_axis(hit, phantom, fire, axis=2)
        np.put_along_axis(where, phantom[..., None], points, axis=2)
        self.forecast.update(hit, where, self._watchers)
