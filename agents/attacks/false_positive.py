"""False positives of every adversary on its own: phantoms in its FOV that stand still or move."""

from __future__ import annotations

import math

import numpy as np

from trust_env.agents.base import FIRE, MOVE, PLACE, Policy, PolicyContext
from trust_env.agents.parameters import (
    fraction_or_none,
    invalid,
    non_negative_or_none,
    one_of,
    whole_number,
    whole_number_or_none,
)
from trust_env.agents.search_ranges import (
    Range,
    SearchRanges,
    hit_rate_range,
    phantom_range,
    start_range,
)
from trust_env.scenario import Scenario

MOTIONS = ("static", "constant_velocity", "random_walk")


class FalsePositive(Policy):
    """False positives at random places in the own FOV, which then stay, move straight on, or wander.

    A phantom that would leave the FOV is replaced by a new one (constant_velocity), or stays where it is for
    a frame (random_walk). Where the scenario lists injections, those of the own agents are replayed
    in place of phantoms, and n, motion and speed do not apply.

    n            phantoms per adversary; None: the whole budget
    motion       static | constant_velocity | random_walk
    speed        m/s; None: drawn as for targets (over a recording: the tracker's initial velocity deviation)
    start        frames to be honest first
    period       frames from one report of a phantom to the next
    hit_rate     probability of such a report; None: the sensor's P_D, as an honest sensor
    """

    name = "false_positive"

    position: np.ndarray  # [W, n, P, 2], m
    velocity: np.ndarray  # [W, n, P, 2], m/s

    def __init__(
        self,
        n: int | None = None,
        motion: str = "static",
        speed: float | None = None,
        start: int = 0,
        period: int = 1,
        hit_rate: float | None = None,
    ):
        self.n = whole_number_or_none(self.name, "n", n, 1, "the whole budget")
        self.motion = one_of(self.name, "motion", motion, MOTIONS)
        self.speed = non_negative_or_none(self.name, "speed", speed, "m/s", "as fast as targets")
        self.start = whole_number(self.name, "start", start, 0)
        self.period = whole_number(self.name, "period", period, 1)
        self.hit_rate = fraction_or_none(self.name, "hit_rate", hit_rate, "the sensor's P_D")

    @classmethod
    def search_ranges(cls, scenario: Scenario) -> SearchRanges:
        return {
            "n": phantom_range(scenario, scenario.injection.slots),
            "motion": MOTIONS,
            "speed": Range(0.0, 2.0 * target_speeds(scenario)[1]),
            "start": start_range(scenario),
            "period": Range(1, 5, whole=True),
            "hit_rate": hit_rate_range(scenario),
        }

    def prepare(self, context: PolicyContext) -> None:
        listed = [[c.position for c in context.scenario.injections if c.agent == k] for k in context.agents]
        self._replays = bool(context.scenario.injections)
        phantoms = max(map(len, listed)) if self._replays else self._count(context.scenario)
        self._hit_rate = hit_rates(context, self.hit_rate)
        self._exists = np.ones((len(listed), phantoms), dtype=bool)  # [n, P]
        self.position = np.zeros((len(context.worlds), len(listed), phantoms, 2))
        self.velocity = np.zeros_like(self.position)
        if self._replays:
            for i, own in enumerate(listed):
                self._exists[i] = np.arange(phantoms) < len(own)
                self.position[:, i, : len(own)] = np.array(own).reshape(-1, 2)

    def _count(self, scenario: Scenario) -> int:
        """Phantoms per adversary."""
        if self.n is None:
            return int(self.injections.max(initial=0))
        if self.n > scenario.injection.slots:
            slots = f"at most {scenario.injection.slots}, the injection slots of scenario {scenario.name!r}"
            raise invalid(self.name, "n", self.n, slots)
        return self.n

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        if not self._replays:
            self._move(seen["pose"])
        since = self.frame - self.start
        fire = ((since >= 0) & (since % self.period == 0))[:, None, None] & self._exists
        if fire.any() and (self._hit_rate < 1.0).any():
            fire = fire & (self.draw(FIRE, self.position.shape[2]) < self._hit_rate[:, None])
        return self.encode(seen["pose"], self.position, fire)

    def _move(self, pose: np.ndarray) -> None:
        """One frame on; new phantoms where an episode begins, or where one has left."""
        new = np.broadcast_to((self.frame == 0)[:, None, None], self.position.shape[:3])
        if self.motion != "static":
            if self.motion == "random_walk":
                self.velocity = _rotated(self.velocity, self.draw(MOVE, self.position.shape[2]))
            moved = self.position + self.dt * self.velocity
            inside = self.fovs.contains(pose, moved)
            if self.motion == "constant_velocity":
                self.position, new = moved, new | ~inside
            else:
                self.position = np.where(inside[..., None], moved, self.position)
        if new.any():
            position, velocity = self._draw_phantoms(pose)
            self.position = np.where(new[..., None], position, self.position)
            self.velocity = np.where(new[..., None], velocity, self.velocity)

    def _draw_phantoms(self, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions uniform in the FOVs, velocities of uniform direction, for a phantom in every slot."""
        draws = self.draw(PLACE, 5 * self.position.shape[2]).reshape(*self.position.shape[:3], 5)
        slow, fast = (self.speed, self.speed) if self.speed is not None else target_speeds(self.context.scenario)
        speed = slow + np.ascontiguousarray(draws[..., 3]) * (fast - slow)
        east = np.stack([speed, np.zeros_like(speed)], axis=-1)
        return self.fovs.sample(pose, draws[..., :3]), _rotated(east, draws[..., 4])


def target_speeds(scenario: Scenario) -> tuple[float, float]:
    """Slowest and fastest, m/s; over a recording both are the tracker's initial velocity deviation."""
    if scenario.targets.data is None:
        return scenario.targets.speed
    deviation = math.sqrt(scenario.tracker.initial_velocity_variance)
    return deviation, deviation


def hit_rates(context: PolicyContext, hit_rate: float | None) -> np.ndarray:
    """Probability that a phantom is reported, by agent [n]; the sensors' P_D for None."""
    sensors = [context.scenario.agent(int(k)).sensor for k in context.agents]
    rates = [sensor.p_detect if hit_rate is None else hit_rate for sensor in sensors]
    return np.array(rates, dtype=np.float64)


def _rotated(velocity: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Velocities [..., 2] of the same length in the directions of `turns` (fractions of a full turn)."""
    length = np.hypot(np.ascontiguousarray(velocity[..., 0]), np.ascontiguousarray(velocity[..., 1]))
    angle = 2.0 * np.pi * np.ascontiguousarray(turns)
    return np.stack([length * np.cos(angle), length * np.sin(angle)], axis=-1)
