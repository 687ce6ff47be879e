"""False positives that every adversary makes up for itself: phantoms, which move as if they were there."""

from __future__ import annotations

import math

import numpy as np

from trust_env.agents.base import FIRE, MOVE, PLACE, Policy, PolicyContext
from trust_env.agents.parameters import length_or_none, one_of, refuse, share_or_none, whole, whole_or_none
from trust_env.scenario import Scenario

MOTIONS = ("static", "constant_velocity", "random_walk")


class FalsePositive(Policy):
    """False positives at random places in the own FOV, which then stay, move straight on, or wander.

    A phantom that would leave the FOV gives way to a new one (constant_velocity), or stays where it is for a
    frame (random_walk). Where the scenario lists injections, those of the own agents are replayed in place of
    phantoms: n, motion and speed do not apply then.

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
        self.n = whole_or_none(self.name, "n", n, 1, "the whole budget")
        self.motion = one_of(self.name, "motion", motion, MOTIONS)
        self.speed = length_or_none(self.name, "speed", speed, "m/s", "as fast as targets")
        self.start = whole(self.name, "start", start, 0)
        self.period = whole(self.name, "period", period, 1)
        self.hit_rate = share_or_none(self.name, "hit_rate", hit_rate, "the sensor's P_D")

    def prepare(self, context: PolicyContext) -> None:
        case = [[c.position for c in context.scenario.injections if c.agent == k] for k in context.agents]
        self._replays = bool(context.scenario.injections)
        phantoms = max(map(len, case)) if self._replays else self._count(context.scenario)
        self._hit_rate = hit_rates(context, self.hit_rate)
        self._exists = np.ones((len(case), phantoms), dtype=bool)
        self.position = np.zeros((len(context.worlds), len(case), phantoms, 2))
        self.velocity = np.zeros_like(self.position)
        if self._replays:
            for i, own in enumerate(case):
                self._exists[i] = np.arange(phantoms) < len(own)
                self.position[:, i, : len(own)] = np.array(own).reshape(-1, 2)

    def _count(self, scenario: Scenario) -> int:
        """Phantoms per adversary."""
        if self.n is None:
            return int(self.injections.max(initial=0))
        if self.n > scenario.injection.slots:
            slots = f"at most {scenario.injection.slots}, the injection slots of scenario {scenario.name!r}"
            raise refuse(self.name, "n", self.n, slots)
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
                self.velocity = _turned(self.velocity, self.draw(MOVE, self.position.shape[2]))
            moved = self.position + self.dt * self.velocity
            inside = self.fovs.contains(pose, moved)
            if self.motion == "constant_velocity":
                self.position, new = moved, new | ~inside
            else:
                self.position = np.where(inside[..., None], moved, self.position)
        if new.any():
            position, velocity = self._drawn(pose)
            self.position = np.where(new[..., None], position, self.position)
            self.velocity = np.where(new[..., None], velocity, self.velocity)

    def _drawn(self, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions uniform in the FOVs, velocities of uniform direction, for a phantom in every slot."""
        draws = self.draw(PLACE, 5 * self.position.shape[2]).reshape(*self.position.shape[:3], 5)
        slow, fast = self._speeds()
        speed = slow + np.ascontiguousarray(draws[..., 3]) * (fast - slow)
        east = np.stack([speed, np.zeros_like(speed)], axis=-1)
        return self.fovs.sample(pose, draws[..., :3]), _turned(east, draws[..., 4])

    def _speeds(self) -> tuple[float, float]:
        """Slowest and fastest, m/s."""
        scenario = self.context.scenario
        if self.speed is not None:
            return self.speed, self.speed
        if scenario.targets.data is None:
            return scenario.targets.speed
        deviation = math.sqrt(scenario.tracker.initial_velocity_variance)
        return deviation, deviation


def hit_rates(context: PolicyContext, hit_rate: float | None) -> np.ndarray:
    """Probability that a phantom is reported, by agent [n]; the sensors' P_D for None."""
    sensors = [context.scenario.agent(int(k)).sensor for k in context.agents]
    return np.array(
        [sensor.p_detect if hit_rate is None else hit_rate for sensor in sensors], dtype=np.float64
    )


def _turned(velocity: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Velocities [..., 2] of the same length in the directions of `turns` (shares of a full turn)."""
    length = np.hypot(np.ascontiguousarray(velocity[..., 0]), np.ascontiguousarray(velocity[..., 1]))
    angle = 2.0 * np.pi * np.ascontiguousarray(turns)
    return np.stack([length * np.cos(angle), length * np.sin(angle)], axis=-1)
