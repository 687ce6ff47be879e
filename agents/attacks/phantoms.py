"""What all attacks with phantoms share: how many there are, how they move, and how they are reported.

A phantom is a place that adversaries report as if a target were there. Without `share` every adversary has
phantoms of its own; with it those of the coalition are reported by all who can. The policy object is the
coalition: its agents tell each other where they stand, whatever the knowledge level.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from trust_env.agents.attacks.motion import drawn_velocities, step, target_speeds
from trust_env.agents.attacks.phantom_parameters import PhantomParameters
from trust_env.agents.base import CHOOSE, FIRE, MOVE, NOISE, PLACE, PolicyContext
from trust_env.agents.parameters import invalid


class Phantoms(PhantomParameters):
    """Reports of phantoms; where they stand is said by `place`, which of them are reported by `due`.

    G groups of P phantoms: one for each of the n adversaries, or a single one that they share.
    """

    reads = ("pose", "detections_mask")

    position: np.ndarray  # [W, G, P, 2], m
    velocity: np.ndarray  # [W, G, P, 2], m/s
    reports: np.ndarray  # bool[W, n, P], which agent reports which phantom of its group
    missing_phantoms: np.ndarray  # int[W], how many of those asked for have no place in this episode

    # --- an episode begins ---

    def prepare(self, context: PolicyContext) -> None:
        worlds, agents, slots = len(context.worlds), len(context.agents), context.scenario.injection.slots
        self._count = self.count(slots, agents)
        sensors = [context.scenario.agent(int(k)).sensor for k in context.agents]
        rates = [sensor.p_detect if self.hit_rate is None else self.hit_rate for sensor in sensors]
        self._hit_rate = np.array(rates, dtype=np.float64)
        self._noise = np.array([self._noise_of(sensor.covariance) for sensor in sensors]).reshape(-1, 2, 2)
        shape = (worlds, 1 if self.is_shared else agents, self._count)
        everywhere = self.n is not None or self.is_shared
        self._asked = shape[1] * self._count if everywhere else int(np.minimum(self._count, self.budgets()).sum())
        self.position, self.velocity = np.zeros((*shape, 2)), np.zeros((*shape, 2))
        self.reports = np.zeros((worlds, agents, self._count), dtype=bool)
        self.missing_phantoms = np.zeros(worlds, dtype=np.int64)
        slots = (worlds, agents, min(slots, self._count))
        self._in_budget = np.arange(slots[2]) < self.injections[:, None]  # [n, M]
        self._phantom, self._due = np.zeros(slots, dtype=np.int64), np.zeros(slots, dtype=bool)

    @property
    def is_shared(self) -> bool:
        """Whether there is one group of phantoms for all adversaries."""
        return self.share

    @property
    def is_moving(self) -> bool:
        return self.motion != "static"

    def budgets(self) -> np.ndarray:
        """How many phantoms each adversary may report, int[n]."""
        return self.injections

    def count(self, slots: int, agents: int) -> int:
        """P; ValueError for more than the slots can ever hold."""
        if self.n is None:
            return int(self.injections.max(initial=0))
        most, whose = slots, f"the injection slots of scenario {self.context.scenario.name!r}"
        if self.is_shared and not self.reported_by_all:
            most, whose = slots * agents, f"the injection slots of {agents} agents"
        if self.n > most:
            raise invalid(self.name, "n", self.n, f"at most {most}, {whose}")
        return self.n

    def _noise_of(self, covariance: tuple[tuple[float, float], tuple[float, float]]) -> np.ndarray:
        """m, the factor [2, 2] of the noise of an agent's reports."""
        return np.linalg.cholesky(np.array(covariance)) if self.noise is None else self.noise * np.eye(2)

    # --- every frame ---

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        self._move(seen)
        new = np.flatnonzero(self.frame == 0)
        if new.size and self._count:
            self._begin(new, {name: values[new] for name, values in seen.items()})
        phantom, fire = self._fire(seen)
        points = self._reported(phantom)
        self.remember(phantom, fire & self._in_budget, points)
        points, fire = self.add_reports(seen, points, fire)
        return self.encode(seen["pose"], points, fire, self._withheld(seen["detections_mask"]))

    def _begin(self, rows: np.ndarray, seen: dict[str, np.ndarray]) -> None:
        """Place the phantoms of the worlds `rows`, give each a slot, and count those that have no place."""
        self.place(rows, seen)
        reports = self.reports[rows]
        phantom = np.argsort(~reports, axis=2, kind="stable")[..., : self._phantom.shape[2]]
        self._phantom[rows], self._due[rows] = phantom, np.take_along_axis(reports, phantom, axis=2)
        placed = reports.any(axis=1).sum(axis=-1) if self.is_shared else reports.sum(axis=(1, 2))
        self.missing_phantoms[rows] = self._asked - placed

    def place(self, rows: np.ndarray, seen: dict[str, np.ndarray]) -> None:
        """Set `position`, `velocity` and `reports` of the worlds `rows`; what is seen is that of these worlds."""
        raise NotImplementedError

    def draw_velocities(self, rows: np.ndarray | slice) -> np.ndarray:
        """Velocities [w, G, P, 2] (m/s) of uniform direction for the worlds `rows`."""
        draws = self.draw(PLACE, 2 * self._count, rows, self._group_agents())
        return drawn_velocities(draws.reshape(*draws.shape[:2], self._count, 2), self.speeds())

    def speeds(self) -> tuple[float, float]:
        """Slowest and fastest, m/s."""
        return target_speeds(self.context.scenario) if self.speed is None else (self.speed, self.speed)

    def _group_agents(self) -> np.ndarray:
        """The agents whose random numbers the groups of phantoms draw."""
        return self.context.agents[:1] if self.is_shared else self.context.agents

    def _move(self, seen: dict[str, np.ndarray]) -> None:
        """One frame on; phantoms that have left their zone begin anew elsewhere in it."""
        if not self.is_moving or not self._count:
            return
        before = self.position

        def turns(rows: np.ndarray | slice) -> np.ndarray:
            return self.draw(MOVE, self._count, rows, self._group_agents())

        def contains(points: np.ndarray, rows: np.ndarray | slice) -> np.ndarray:
            return self.zone(seen, points, rows)

        self.position, self.velocity, left = step(self.motion, before, self.velocity, turns, self.dt, contains)
        left = left & (self.frame > 0)[:, None, None]
        if left.any():
            self.replace(seen, left, before)

    def zone(self, seen: dict[str, np.ndarray], points: np.ndarray, rows: np.ndarray | slice) -> np.ndarray:
        """Whether the phantoms of the worlds `rows` may stand at points[w, G, P, 2], bool[w, G, P]: where their
        reporters see.
        """
        held = self.fovs.contains(seen["pose"][rows], points) | ~self.reports[rows]
        return np.all(held, axis=1, keepdims=True) if self.is_shared else held

    def seen_by_own(self, pose: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Which adversaries see points[w, G, Q, 2], bool[w, n, G, Q]."""
        inside = self.fovs.contains(pose, points.reshape(len(points), 1, -1, 2))
        return inside.reshape(*inside.shape[:2], *points.shape[1:-1])

    def replace(self, seen: dict[str, np.ndarray], left: np.ndarray, before: np.ndarray) -> None:
        """Give phantoms that have left[W, G, P] a new position and velocity; they were at `before`."""
        raise NotImplementedError

    def due(self, seen: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Which phantom of its group every agent's slots report, int[W, n, M], and whether they do, bool."""
        return self._phantom, self._due

    def active(self) -> np.ndarray:
        """In which worlds the attack is on in the present frame, bool[W]."""
        return self.frame >= self.start

    def reporting(self) -> np.ndarray:
        """In which worlds phantoms are reported in the present frame, bool[W]."""
        return self.active()

    def remember(self, phantom: np.ndarray, fire: np.ndarray, points: np.ndarray) -> None:
        """Hook: what the slots report in this frame, phantom int[W, n, M] where fire, at points[W, n, M, 2] (m)."""

    def add_reports(
        self, seen: dict[str, np.ndarray], points: np.ndarray, fire: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Hook: points[W, n, M, 2] and fire[W, n, M] with what further slots report."""
        return points, fire

    def _fire(self, seen: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """The phantom in every slot, and whether it is reported in this frame, each [W, n, M]."""
        phantom, due = self.due(seen)
        fire = due & self.reporting()[:, None, None]
        if fire.any() and (self._hit_rate < 1.0).any():
            fire = fire & (self.draw(FIRE, fire.shape[2]) < self._hit_rate[:, None])
        return phantom, fire

    def _reported(self, phantom: np.ndarray) -> np.ndarray:
        """Positions [W, n, M, 2] (m) of the phantoms in the slots, with noise."""
        position = np.broadcast_to(self.position, (*self.reports.shape, 2))
        points = np.take_along_axis(position, phantom[..., None], axis=2)
        if not self._noise.any() or not points.size:
            return points
        draws = self.draw(NOISE, 2 * phantom.shape[2]).reshape(points.shape)
        # 53 random bits include 0, whose quantile is not finite; the least that is not 0 is 2^-53.
        normal = ndtri(np.maximum(draws, 2.0**-53))
        factor, a, b = self._noise[:, None], normal[..., 0], normal[..., 1]
        x = factor[..., 0, 0] * a
        y = factor[..., 1, 0] * a + factor[..., 1, 1] * b
        return points + np.stack([x, y], axis=-1)

    def _withheld(self, mask: np.ndarray) -> np.ndarray | None:
        """Which own detections bool[W, n, D] are not reported; None: all are."""
        if self.suppress == 0.0:
            return None
        active = self.active()[:, None, None]
        if self.suppress == 1.0:
            return mask & active
        return mask & active & (self.draw(CHOOSE, mask.shape[-1]) < self.suppress)
