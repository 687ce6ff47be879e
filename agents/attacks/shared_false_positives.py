"""False positives that adversaries share: each phantom is reported by all of them whose FOVs hold it.

The policy object is the coalition: its agents tell each other where they stand, whatever the knowledge level.
"""

from __future__ import annotations

import numpy as np

from trust_env.agents.attacks.false_positive import hit_rates
from trust_env.agents.base import CANDIDATE, FIRE, Policy, PolicyContext
from trust_env.agents.parameters import fraction_or_none, invalid, whole_number, whole_number_or_none
from trust_env.agents.search_ranges import (
    Range,
    SearchRanges,
    hit_rate_range,
    phantom_range,
    start_range,
)
from trust_env.scenario import Fovs, Scenario

CANDIDATES = 512  # places that are compared in a world
CHUNK = 32  # worlds at a time, so that the candidates of many worlds need not fit into memory at once
WELL_INSIDE = 0.05  # margin, as a fraction of the distance to the middle of an FOV
FORBIDDEN = -(1 << 40)  # rank of a place where no phantom may stand


class SharedPhantoms(Policy):
    """Static phantoms at the best of many random places, by the `rank` of the attack."""

    position: np.ndarray  # [W, n, M, 2], m, by injection slot
    reported: np.ndarray  # bool[W, n, M], slots that hold a phantom

    def __init__(self, n: int | None, start: int, hit_rate: float | None):
        self.n = whole_number_or_none(self.name, "n", n, 1, "as many as one adversary can report")
        self.start = whole_number(self.name, "start", start, 0)
        self.hit_rate = fraction_or_none(self.name, "hit_rate", hit_rate, "the sensor's P_D")

    @classmethod
    def search_ranges(cls, scenario: Scenario) -> SearchRanges:
        adversaries = scenario.roles.count("adversary")
        return {
            "n": phantom_range(scenario, scenario.injection.slots * max(1, adversaries)),
            "start": start_range(scenario),
            "hit_rate": hit_rate_range(scenario),
        }

    def prepare(self, context: PolicyContext) -> None:
        slots = context.scenario.injection.slots
        most = slots * len(context.agents)
        if self.n is not None and self.n > most:
            expected = f"at most {most}, the injection slots of {len(context.agents)} agents"
            raise invalid(self.name, "n", self.n, expected)
        self._phantoms = int(self.injections.max(initial=0)) if self.n is None else self.n
        self._hit_rate = hit_rates(context, self.hit_rate)
        shape = (len(context.worlds), len(context.agents), min(slots, self._phantoms))
        self.position, self.reported = np.zeros((*shape, 2)), np.zeros(shape, dtype=bool)

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        new = np.flatnonzero(self.frame == 0)
        for first in range(0, new.size if self._phantoms else 0, CHUNK):
            rows = new[first : first + CHUNK]
            self._place(rows, {name: values[rows] for name, values in seen.items()})
        fire = self.reported & (self.frame >= self.start)[:, None, None]
        if fire.any() and (self._hit_rate < 1.0).any():
            fire = fire & (self.draw(FIRE, fire.shape[2]) < self._hit_rate[:, None])
        return self.encode(seen["pose"], self.position, fire)

    def _place(self, rows: np.ndarray, seen: dict[str, np.ndarray]) -> None:
        """Draw the phantoms of worlds `rows`: the best candidates, and of equally good ones the first."""
        candidates = self._candidates(rows, seen["pose"])  # [w, C, 2]
        rank = self.rank(seen, candidates)
        best = np.argsort(-rank, axis=1, kind="stable")[:, : self._phantoms]
        places = np.take_along_axis(candidates, best[..., None], axis=1)  # [w, P, 2]
        allowed = np.take_along_axis(rank, best, axis=1) > FORBIDDEN
        reports = self.fovs.contains(seen["pose"], places[:, None]) & allowed[:, None]  # [w, n, P]
        slots = np.argsort(~reports, axis=2, kind="stable")[..., : self.position.shape[2]]
        self.reported[rows] = np.take_along_axis(reports, slots, axis=2)
        by_agent = np.broadcast_to(places[:, None], (*reports.shape, 2))
        self.position[rows] = np.take_along_axis(by_agent, slots[..., None], axis=2)

    def _candidates(self, rows: np.ndarray, pose: np.ndarray) -> np.ndarray:
        """Uniform points [w, C, 2] (m), by turns in the box that the FOVs' boxes share and in an FOV."""
        agents = len(self.context.agents)
        draws = self.draw(CANDIDATE, 3 * CANDIDATES, rows, self.context.agents[:1])
        draws = draws.reshape(len(rows), CANDIDATES, 3)
        box = self.fovs.boxes(pose)  # [w, n, 4]
        low, high = box[..., 0::2].max(axis=1)[:, None], box[..., 1::2].min(axis=1)[:, None]  # [w, 1, 2]
        shared = low + draws[..., :2] * (high - low)
        own = self.fovs.sample(pose, np.broadcast_to(draws[:, None], (len(rows), agents, CANDIDATES, 3)))
        turn = np.arange(CANDIDATES)
        own = own[:, turn // 2 % agents, turn]
        overlap = (high > low).all(axis=-1, keepdims=True)  # [w, 1, 1]
        return np.where(overlap & (turn % 2 == 0)[:, None], shared, own)

    def rank(self, seen: dict[str, np.ndarray], candidates: np.ndarray) -> np.ndarray:
        """How good the candidates [w, C, 2] are, int[w, C]; FORBIDDEN where no phantom may stand."""
        raise NotImplementedError


class OptimalFalsePositive(SharedPhantoms):
    """Static false positives where the FOVs of all adversaries intersect, which all report in every frame.

    Every one lies on the tracker's predicted position, d² = 0, which gains the most (Hallyburton & Pajic
    2024, Prop. 1): alone it is confirmed in the frame of `trust_env.theory.score_optimal_frames`. Where no
    point lies in all FOVs, a phantom is put where as many adversaries as possible can report it.

    n            phantoms in all; None: as many as one adversary can report
    start        frames to be honest first
    hit_rate     probability that an adversary reports a phantom, 1; None: the sensor's P_D
    """

    name = "optimal_false_positive"

    def __init__(self, n: int | None = None, start: int = 0, hit_rate: float | None = 1.0):
        super().__init__(n, start, hit_rate)

    def rank(self, seen: dict[str, np.ndarray], candidates: np.ndarray) -> np.ndarray:
        return self._holders(seen["pose"], candidates)

    def _holders(self, pose: np.ndarray, candidates: np.ndarray) -> np.ndarray:
        """First how many own FOVs hold a candidate, then how many hold it well inside; int[w, C]."""
        points, most = candidates[:, None], len(self.context.agents) + 1
        held = self.fovs.contains(pose, points).sum(axis=1)
        well = self.fovs.contains(pose, points, WELL_INSIDE).sum(axis=1)
        return np.where(held > 0, most * held + well, FORBIDDEN)


class FovAware(OptimalFalsePositive):
    """Static false positives in as few honest agents' FOVs as possible, reported by all adversaries that can.

    Among places that equally few honest agents see it takes those that the most adversaries see. Every agent
    outside the coalition counts as honest.

    max_honest   phantoms that more honest agents would see are left out; None: no limit
    n            phantoms in all; None: as many as one adversary can report
    start        frames to be honest first
    hit_rate     probability that an adversary reports a phantom; None: the sensor's P_D, as an honest sensor
    """

    name = "fov_aware"
    knowledge = "poses"

    def __init__(
        self,
        max_honest: int | None = None,
        n: int | None = None,
        start: int = 0,
        hit_rate: float | None = None,
    ):
        super().__init__(n, start, hit_rate)
        self.max_honest = whole_number_or_none(self.name, "max_honest", max_honest, 0, "no limit")

    @classmethod
    def search_ranges(cls, scenario: Scenario) -> SearchRanges:
        honest = scenario.n_agents - scenario.roles.count("adversary")
        return {"max_honest": Range(0, honest, whole=True, none=honest), **super().search_ranges(scenario)}

    def prepare(self, context: PolicyContext) -> None:
        super().prepare(context)
        self._honest = np.setdiff1d(np.arange(context.scenario.n_agents), context.agents)
        self._honest_fovs = Fovs.of(context.scenario, self._honest)

    def rank(self, seen: dict[str, np.ndarray], candidates: np.ndarray) -> np.ndarray:
        holders = self._holders(seen["pose"], candidates)
        poses = seen["poses"][:, 0, self._honest]  # [w, K - n, 4]: every agent sees the same
        witnesses = self._honest_fovs.contains(poses, candidates[:, None]).sum(axis=1)
        most = (len(self.context.agents) + 1) ** 2
        forbidden = holders == FORBIDDEN
        if self.max_honest is not None:
            forbidden |= witnesses > self.max_honest
        return np.where(forbidden, FORBIDDEN, holders - most * witnesses)
