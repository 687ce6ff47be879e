"""Attacks on the tracks of true targets, which adversaries follow: drag, steal."""

from __future__ import annotations

import numpy as np

from trust_env.agents.attacks.detection_tracker import DetectionTracker
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

    withholds: bool = False  # whether the detection itself is suppressed

    def __init__(self, n: int | None, start: int):
        self.n = whole_number_or_none(self.name, "n", n, 1, "as many as one adversary can report")
        self.start = whole_number(self.name, "start", start, 0)

    @classmethod
    def search_ranges(cls, scenario: Scenario) -> SearchRanges:
        return {"n": phantom_range(scenario, scenario.injection.slots), "start": start_range(scenario)}

    def prepare(self, context: PolicyContext) -> None:
        slots = context.scenario.injection.slots
        if self.n is not None and self.n > slots:
            whose = f"at most {slots}, the injection slots of scenario {context.scenario.name!r}"
            raise invalid(self.name, "n", self.n, whose)
        self._most = np.minimum(self.injections, slots if self.n is None else self.n)  # [n]
        self._slots = int(self._most.max(initial=0))
        self.targets = DetectionTracker(context.scenario, context.agents, len(context.worlds))
        shape = self.targets.alive.shape  # [W, n, T]
        self.looks = np.zeros(shape, dtype=np.int64)  # detections of each target
        self.since = np.zeros(shape, dtype=np.int64)  # frames since it was chosen
        self.heading = np.zeros(shape)  # of the shift, fraction of a full turn
        self.deviation = np.sqrt(self.targets.noise)  # [n, 1], m

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        points, mask = seen["detections"], seen["detections_mask"]
        slot, chosen = self._follow(points, mask)
        shifted = self.shifted(points, slot)
        inside = self.fovs.contains(seen["pose"], shifted)
        self._release(slot, chosen & ~inside)
        chosen = chosen & inside & (self.frame >= self.start)[:, None, None]
        order = np.argsort(~chosen, axis=2, kind="stable")[..., : self._slots]
        injected, fire = np.take_along_axis(shifted, order[..., None], axis=2), np.take_along_axis(chosen, order, 2)
        injected = np.where(fire[..., None], injected, seen["pose"][:, :, None, :2])
        return self.encode(seen["pose"], injected, fire, chosen if self.withholds else None)

    def shifted(self, points: np.ndarray, slot: np.ndarray) -> np.ndarray:
        """Where detections points[W, n, D, 2] of the targets slot[W, n, D] are reported, [W, n, D, 2], m."""
        raise NotImplementedError

    def _follow(self, points: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The target of every detection, int[W, n, D], and whether it is chosen; new ones are, while there is room."""
        self.targets.clear(self.frame == 0)
        self.predicted = self.targets.position + self.targets.dt * self.targets.velocity
        slot, new = self.targets.update(points, mask)
        w, n, d = np.nonzero(mask)
        at = (w, n, slot[w, n, d])
        self.looks[at] = np.where(new[w, n, d], 1, self.looks[at] + 1)
        self.since += 1
        tracked = np.maximum(slot, 0)
        chosen = mask & np.take_along_axis(self.targets.chosen & self.targets.alive, tracked, axis=2)
        room = self._most - (self.targets.chosen & self.targets.alive).sum(axis=2)  # [W, n]
        free = mask & ~chosen & (np.take_along_axis(self.looks, tracked, axis=2) >= SETTLED)
        free &= (self.frame >= self.start)[:, None, None]
        taken = free & (np.cumsum(free, axis=2) <= room[..., None])
        if taken.any():
            w, n, d = np.nonzero(taken)
            at = (w, n, slot[w, n, d])
            self.targets.chosen[at], self.since[at] = True, 0
            self.heading[at] = self.draw(MOVE, self.heading.shape[2])[at]
        return slot, chosen | taken

    def _release(self, slot: np.ndarray, released: np.ndarray) -> None:
        """Give up targets whose shifted reports would leave the FOV; they have to settle again."""
        w, n, d = np.nonzero(released)
        self.targets.chosen[w, n, slot[w, n, d]] = False
        self.looks[w, n, slot[w, n, d]] = 0

    def _shift(self, slot: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """distance[W, n, D] (m) in the directions of the targets, [W, n, D, 2]."""
        turns = np.take_along_axis(self.heading, np.maximum(slot, 0), axis=2)
        return rotated(np.stack([distance, np.zeros_like(distance)], axis=-1), turns)


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
    def search_ranges(cls, scenario: Scenario) -> SearchRanges:
        usual = 0.2 * noise_deviation(scenario) / scenario.dt
        own = {"rate": Range(0.0, 5.0 * usual, none=usual), "profile": PROFILES}
        return {**own, **super().search_ranges(scenario)}

    def shifted(self, points: np.ndarray, slot: np.ndarray) -> np.ndarray:
        since = np.take_along_axis(self.since, np.maximum(slot, 0), axis=2)
        frames = since if self.profile == "linear" else 0.5 * since * since
        dt = self.dt if self.profile == "linear" else self.dt**2
        each = 0.2 * self.deviation if self.rate is None else self.rate * dt  # m, of a frame
        return points + self._shift(slot, frames * each)


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
    def search_ranges(cls, scenario: Scenario) -> SearchRanges:
        return {"offset": Range(0.0, 6.0), **super().search_ranges(scenario)}

    def shifted(self, points: np.ndarray, slot: np.ndarray) -> np.ndarray:
        at = np.maximum(slot, 0)[..., None]
        predicted = np.take_along_axis(self.predicted, at, axis=2)
        return predicted + self._shift(slot, np.broadcast_to(self.offset * self.deviation, slot.shape))
