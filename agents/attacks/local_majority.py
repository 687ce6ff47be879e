"""False positives where adversaries are the local majority, so that whoever contradicts them is accused."""

from __future__ import annotations

from typing import Any

import numpy as np

from trust_env.agents.attacks.detection_tracker import used_length
from trust_env.agents.attacks.motion import target_speeds
from trust_env.agents.attacks.placed_phantoms import HonestWitnesses
from trust_env.agents.base import PolicyContext
from trust_env.agents.parameters import invalid, whole_number_or_none
from trust_env.agents.search_ranges import Range, SearchRanges, noise_deviation, phantom_range
from trust_env.scenario import Scenario

_NO_MAJORITY = 1 << 20  # cost of a place where adversaries are no majority


class Framing(HonestWitnesses):
    """False positives that only the adversaries and one honest agent, the victim, can see.

    The victim alone contradicts them, and its trust falls. Among the places it takes those that the most
    adversaries see.

    victim       the victim among the honest agents, from 0; None: in each episode the one who can be framed best
    """

    name = "framing"
    max_cost = 0

    def __init__(
        self,
        victim: int | None = None,
        n: int | None = None,
        share: bool = True,
        motion: str = "static",
        speed: float | None = None,
        noise: float | None = None,
        hit_rate: float | None = None,
        start: int = 0,
        suppress: float = 0.0,
    ):
        super().__init__(n, share, motion, speed, noise, hit_rate, start, suppress)
        self.victim = whole_number_or_none(self.name, "victim", victim, 0, "who can be framed best")

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        honest = scenario.roles.count("benign")
        return {"victim": Range(0, max(0, honest - 1), whole=True), **super().search_ranges(scenario, **given)}

    def prepare(self, context: PolicyContext) -> None:
        super().prepare(context)
        honest = len(self.witnesses.agents)
        if self.victim is not None and self.victim >= max(1, honest):
            raise invalid(self.name, "victim", self.victim, f"a number below {honest}, that of the honest agents")
        self.victims = np.zeros((len(context.worlds), honest), dtype=bool)  # [W, H], one of each world

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        return super().choose({**seen, "victim": self.victims})

    def place(self, rows: np.ndarray, seen: dict[str, np.ndarray]) -> None:
        if self.victims.shape[1]:
            chosen = self._best_victims(rows, seen) if self.victim is None else self.victim
            self.victims[rows] = np.arange(self.victims.shape[1]) == np.reshape(chosen, (-1, 1))
        super().place(rows, {**seen, "victim": self.victims[rows]})

    def _best_victims(self, rows: np.ndarray, seen: dict[str, np.ndarray]) -> np.ndarray:
        """The honest agents int[w] who alone see the most places, each counted by the square of how many
        adversaries see it.
        """
        points = self._candidates(rows, seen["pose"])
        sees = self.witnesses.see(seen, points)  # [w, H, G, C]
        adversaries = self.seen_by_own(seen["pose"], points).sum(axis=1)
        alone = sees & (sees.sum(axis=1, keepdims=True) == 1)
        return (alone * adversaries[:, None] ** 2).sum(axis=(2, 3)).argmax(axis=1)

    def cost(self, seen: dict[str, np.ndarray], points: np.ndarray) -> np.ndarray:
        """How many honest agents have to be added or removed for the victim to be the only one."""
        sees, victim = self.witnesses.see(seen, points), seen["victim"][:, :, None, None]
        return (sees != victim).sum(axis=1) + ~victim.any(axis=1)


class Collusion(HonestWitnesses):
    """The same false positives of all adversaries where they outnumber honest agents, and all true targets.

    A slot that no phantom needs reports a target that the adversary has missed and another one has detected
    inside its FOV, so that honest agents are never contradicted where they are the majority. n by default
    leaves one slot of the budget for it.
    """

    name = "collusion"
    reads = ("pose", "detections", "detections_mask", "poses")
    max_cost = _NO_MAJORITY - 1

    def __init__(
        self,
        n: int | None = None,
        share: bool = True,
        motion: str = "static",
        speed: float | None = None,
        noise: float | None = None,
        hit_rate: float | None = None,
        start: int = 0,
        suppress: float = 0.0,
    ):
        super().__init__(n, share, motion, speed, noise, hit_rate, start, suppress)

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        usual = phantom_range(scenario, cls.most_phantoms(scenario, **given))
        usual = usual._replace(none=max(1, scenario.injection.slots - 1))
        return {**super().search_ranges(scenario, **given), "n": usual}

    def prepare(self, context: PolicyContext) -> None:
        super().prepare(context)
        detections = context.scenario.sensor.max_detections
        self._before = np.zeros((len(context.worlds), len(context.agents), detections, 2))  # m, of the last frame
        self._before_mask = np.zeros(self._before.shape[:-1], dtype=bool)
        self._same = 5.0 * noise_deviation(context.scenario)  # m, farther apart two detections are of two targets
        self._step = self._same + context.scenario.dt * target_speeds(context.scenario)[1]  # m, in a frame

    def count(self, slots: int, agents: int) -> int:
        count = super().count(slots, agents)
        return max(min(count, 1), count - 1) if self.n is None else count

    def cost(self, seen: dict[str, np.ndarray], points: np.ndarray) -> np.ndarray:
        """Above all adversaries that do not see a place, then honest agents that do."""
        adversaries = self.seen_by_own(seen["pose"], points).sum(axis=1)
        honest, weight = super().cost(seen, points), len(self.witnesses.agents) + 1
        cost = honest + weight * (len(self.context.agents) - adversaries)
        return np.where(adversaries > honest, cost, cost + _NO_MAJORITY)

    def add_reports(
        self, seen: dict[str, np.ndarray], points: np.ndarray, fire: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """In further slots, as far as there are any, the targets that each adversary has missed."""
        self._before_mask[self.frame == 0] = False
        spare = self.context.scenario.injection.slots - points.shape[2]
        if spare > 0:
            found, missed = self._missed(seen, spare)
            points = np.concatenate([points, found], axis=2)
            fire = np.concatenate([fire, missed & self.active()[:, None, None]], axis=2)
        self._before, self._before_mask = seen["detections"], seen["detections_mask"]
        return points, fire

    def _missed(self, seen: dict[str, np.ndarray], most: int) -> tuple[np.ndarray, np.ndarray]:
        """Detections [W, n, most, 2] (m) of others inside the own FOV, far from all own ones and near one of the last
        frame, so that they are hardly clutter; and where there are any.
        """
        worlds, agents, _ = seen["detections_mask"].shape
        used = used_length(seen["detections_mask"] | self._before_mask)
        points, mask = seen["detections"][:, :, :used], seen["detections_mask"][:, :, :used]
        now = points.reshape(worlds, 1, -1, 2)  # [W, 1, n used, 2]
        near_own = _near(points, mask, now, self._same)  # [W, n, n used]
        before = self._before[:, :, :used], self._before_mask[:, :, :used]
        steady = _near(*before, now, self._step).any(axis=1, keepdims=True)
        others = np.arange(agents * used) // used != np.arange(agents)[:, None]
        missed = mask.reshape(worlds, 1, -1) & others & steady & ~near_own & self.fovs.contains(seen["pose"], now)
        order = np.argsort(~missed, axis=2, kind="stable")[..., :most]
        found = np.take_along_axis(np.broadcast_to(now, (*missed.shape, 2)), order[..., None], axis=2)
        there = np.take_along_axis(missed, order, axis=2)
        return np.where(there[..., None], found, seen["pose"][:, :, None, :2]), there


def _near(points: np.ndarray, there: np.ndarray, places: np.ndarray, distance: float) -> np.ndarray:
    """Whether any of the points[W, n, D, 2] that are there lies near each of places[W, 1, Q, 2], bool[W, n, Q]."""
    dx = points[:, :, :, None, 0] - places[:, :, None, :, 0]
    dy = points[:, :, :, None, 1] - places[:, :, None, :, 1]
    near = (dx * dx + dy * dy <= distance**2) & there[..., None]
    return np.asarray(near.any(axis=2))
