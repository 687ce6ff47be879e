"""Attacks on the tracks of true targets, which adversaries follow: drag, steal."""

from __future__ import annotations

from typing import Any

import numpy as np

from trust_env.agents.attacks.detection_tracker import DetectionTracker, used_length
from trust_env.agents.attacks.motion import rotated
from trust_env.agents.base import MOVE, Policy, PolicyContext
from trust_env.agents.parameters import (
    invalid,
    non_negative,
    non_negative_or_none,
    one_of,
    whole_number,
    whole_number_or_none,
)
from trust_env.agents.search_ranges import (
    Range,
    SearchRanges,
    noise_deviation,
    phantom_range,
    start_range,
)
from trust_env.scenario import Scenario

PROFILES = ("linear", "quadratic")
SETTLED = 3  # detections after which a target is followed; clutter seldom has as many


class FollowedTargets(Policy):
    """What Drag and Steal share: up to n targets of each adversary, chosen for as long as it sees them.

    Every adversary follows its detections with filters of its own; a chosen target has a slot, and a direction
    in which its reports are shifted.
    """

    reads = ("pose", "detections", "detections_mask")
    withholds: bool = False  # whether the detection itself is suppressed

    def __init__(self, n: int | None, start: int):
        self.n = whole_number_or_none(self.name, "n", n, 1, "as many as one adversary can report")
        self.start = whole_number(self.name, "start", start, 0)

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        return {"n": phantom_range(scenario, scenario.injection.slots), "start": start_range(scenario)}

    def prepare(self, context: PolicyContext) -> None:
        slots = context.scenario.injection.slots
        if self.n is not None and self.n > slots:
            whose = f"at most {slots}, the injection slots of scenario {context.scenario.name!r}"
            raise invalid(self.name, "n", self.n, whose)
        self._most = np.minimum(self.injections, slots if self.n is None else self.n)  # [n]
        self._slots = int(self._most.max(initial=0))
        self.targets = DetectionTracker(context.scenario, context.agents, len(context.worlds))
        shape = self.targets.chosen.shape  # [W, n, T]
        self._first = np.arange(shape[0] * shape[1]).reshape(*shape[:2], 1) * shape[2]  # of each agent, flat
        # Of the targets, in the order of their slots:
        self.looks = np.zeros(shape, dtype=np.int64)  # detections of it
        self.since = np.zeros(shape, dtype=np.int64)  # frames since it was chosen
        self.heading = np.zeros((*shape, 2))  # direction of its shift
        self.deviation = np.sqrt(self.targets.noise)  # [n, 1], m

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        most = seen["detections_mask"].shape[2]
        used = min(most, max(self._slots, used_length(seen["detections_mask"])))
        points, mask = seen["detections"][:, :, :used], seen["detections_mask"][:, :, :used]
        at, chosen = self._follow(points, mask)
        order = np.argsort(~chosen, axis=2, kind="stable")[..., : self._slots]
        at, fire = (np.take_along_axis(values, order, axis=2) for values in (at, chosen))
        shifted = self.shifted(np.take_along_axis(points, order[..., None], axis=2), at)
        inside = self.fovs.contains(seen["pose"], shifted)
        self._release(at[fire & ~inside])
        fire = fire & inside
        injected = np.where(fire[..., None], shifted, seen["pose"][:, :, None, :2])
        if not self.withholds:
            return self.encode(seen["pose"], injected, fire)
        suppress = np.zeros_like(seen["detections_mask"])
        np.put_along_axis(suppress, order, fire, axis=2)
        return self.encode(seen["pose"], injected, fire, suppress)

    def shifted(self, points: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Where detections points[W, n, D, 2] of the targets at[W, n, D] are reported, [W, n, D, 2], m."""
        raise NotImplementedError

    def _follow(self, points: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The target of every detection, int[W, n, D] among all targets, and whether it is chosen; new ones are,
        while there is room.
        """
        self.targets.clear(self.frame == 0)
        slot, new = self.targets.update(points, mask)
        at, self.since = self._first + np.maximum(slot, 0), self.since + 1
        looks = np.where(new, 1, self.looks.reshape(-1)[at] + 1)
        self.looks.reshape(-1)[at[mask]] = looks[mask]
        chosen = mask & self.targets.chosen.reshape(-1)[at]
        free = mask & ~chosen & (looks >= SETTLED) & (self.frame >= self.start)[:, None, None]
        if free.any():
            room = self._most - (self.targets.chosen & self.targets.alive).sum(axis=2)  # [W, n]
            taken = free & (np.cumsum(free, axis=2) <= room[..., None])
            self._take(at[taken])
            chosen |= taken
        return at, chosen

    def _take(self, at: np.ndarray) -> None:
        """Choose targets, each with a direction of its own."""
        if at.size:
            _, agents, slots = self.since.shape
            rows, world = np.unique(at // (agents * slots), return_inverse=True)
            turns = self.draw(MOVE, slots, rows)[world, at // slots % agents, at % slots]
            self.targets.chosen.reshape(-1)[at], self.since.reshape(-1)[at] = True, 0
            self.heading.reshape(-1, 2)[at] = rotated(np.array([[1.0, 0.0]]), turns)

    def _release(self, at: np.ndarray) -> None:
        """Give up targets; they have to settle again."""
        self.targets.chosen.reshape(-1)[at] = False
        self.looks.reshape(-1)[at] = 0


class Drag(FollowedTargets):
    """Suppresses detections of true targets and reports them shifted by an offset that grows.

    As long as the offset grows slowly the reports hit the target's track, so that they earn trust while its state
    goes wrong. A target is let go when its shifted report would leave the FOV.

    rate         m/s, of quadratic m/s^2; None: a fifth of the noise's standard deviation a frame (a frame^2)
    profile      linear: rate t | quadratic: rate t^2 / 2
    n            targets of each adversary; None: as many as it can report
    start        frames to be honest first
    """

    name = "drag"
    withholds = True

    def __init__(self, rate: float | None = None, profile: str = "linear", n: int | None = None, start: int = 0):
        super().__init__(n, start)
        self.rate = non_negative_or_none(self.name, "rate", rate, "m/s", "a fifth of the noise a frame")
        self.profile = one_of(self.name, "profile", profile, PROFILES)

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        usual = 0.2 * noise_deviation(scenario) / scenario.dt
        own = {"rate": Range(0.0, 5.0 * usual, none=usual), "profile": PROFILES}
        return {**own, **super().search_ranges(scenario, **given)}

    def shifted(self, points: np.ndarray, at: np.ndarray) -> np.ndarray:
        since = self.since.reshape(-1)[at]
        frames = since if self.profile == "linear" else 0.5 * since * since
        dt = self.dt if self.profile == "linear" else self.dt**2
        each = 0.2 * self.deviation if self.rate is None else self.rate * dt  # m, of a frame
        return points + (frames * each)[..., None] * self.heading.reshape(-1, 2)[at]


class Steal(FollowedTargets):
    """Reports a false positive beside a true target's track, to win its assignment from the true detection.

    It stands `offset` from where the track is predicted, nearer than most detections: the track follows it, and
    the detection that is left over starts a second track.

    offset       standard deviations of the sensor's noise, in one direction for each target
    n            targets of each adversary; None: as many as it can report
    start        frames to be honest first
    """

    name = "steal"

    def __init__(self, offset: float = 1.5, n: int | None = None, start: int = 0):
        super().__init__(n, start)
        self.offset = non_negative(self.name, "offset", offset, "standard deviations")

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        return {"offset": Range(0.0, 6.0), **super().search_ranges(scenario, **given)}

    def shifted(self, points: np.ndarray, at: np.ndarray) -> np.ndarray:
        offset = self.offset * self.deviation[..., None]  # [n, 1, 1], m
        return self.targets.predicted.reshape(-1, 2)[at] + offset * self.heading.reshape(-1, 2)[at]
