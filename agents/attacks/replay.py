"""Old detections once more: targets get tails of ghosts."""

from __future__ import annotations

from typing import Any

import numpy as np

from trust_env.agents.attacks.detection_tracker import DetectionTracker, used_length
from trust_env.agents.base import Policy, PolicyContext
from trust_env.agents.parameters import invalid, whole_number, whole_number_or_none
from trust_env.agents.search_ranges import Range, SearchRanges, half_episode, phantom_range, start_range
from trust_env.scenario import Scenario


class Replay(Policy):
    """Resends own detections some frames late, beside those of the present frame: every target has a ghost behind it.

    Of more targets than slots it keeps to those that it has followed longest.

    lag          frames from a detection to its repetition
    n            detections repeated in a frame by each adversary; None: as many as it can report
    start        frames to be honest first
    """

    name = "replay"
    reads = ("pose", "detections", "detections_mask")

    def __init__(self, lag: int = 10, n: int | None = None, start: int = 0):
        self.lag = whole_number(self.name, "lag", lag, 1)
        self.n = whole_number_or_none(self.name, "n", n, 1, "as many as one adversary can report")
        self.start = whole_number(self.name, "start", start, 0)

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        return {
            "lag": Range(1, half_episode(scenario), whole=True),
            "n": phantom_range(scenario, scenario.injection.slots),
            "start": start_range(scenario),
        }

    def prepare(self, context: PolicyContext) -> None:
        slots = context.scenario.injection.slots
        if self.n is not None and self.n > slots:
            whose = f"at most {slots}, the injection slots of scenario {context.scenario.name!r}"
            raise invalid(self.name, "n", self.n, whose)
        worlds, agents, count = len(context.worlds), len(context.agents), slots if self.n is None else self.n
        self.targets = DetectionTracker(context.scenario, context.agents, worlds)
        # What is to be repeated, in a ring: entry t % lag was seen in the frame t, counted in all worlds together.
        self.seen = np.zeros((self.lag, worlds, agents, count, 2))  # m
        self.there = np.zeros(self.seen.shape[:-1], dtype=bool)
        self._now = 0

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        used, count = used_length(seen["detections_mask"]), self.seen.shape[3]
        points, mask = seen["detections"][:, :, :used], seen["detections_mask"][:, :, :used]
        began = self.frame == 0
        self.targets.clear(began)
        self.there[:, began] = False
        slot, _ = self.targets.update(points, mask)
        entry = self._now % self.lag
        fire = self.there[entry] & (self.frame >= self.start)[:, None, None]
        repeated = np.where(fire[..., None], self.seen[entry], seen["pose"][:, :, None, :2])
        # Slots of targets are filled from the first on, so that the lowest have been followed longest.
        order = np.argsort(np.where(mask, slot, self.targets.chosen.shape[2]), axis=2, kind="stable")[..., :count]
        kept = order.shape[2]  # fewer than slots where nobody sees as many
        self.there[entry, :, :, kept:] = False
        self.seen[entry, :, :, :kept] = np.take_along_axis(points, order[..., None], axis=2)
        self.there[entry, :, :, :kept] = np.take_along_axis(mask, order, axis=2)
        self._now += 1
        return self.encode(seen["pose"], repeated, fire)
