"""False positives out of sight of honest agents, who could contradict them."""

from __future__ import annotations

from typing import Any

import numpy as np

from trust_env.agents.attacks.placed_phantoms import HonestWitnesses
from trust_env.agents.base import PolicyContext
from trust_env.agents.parameters import whole_number_or_none
from trust_env.agents.search_ranges import Range, SearchRanges
from trust_env.scenario import Scenario


class FovAware(HonestWitnesses):
    """False positives in as few honest agents' FOVs as possible, reported by all adversaries that can.

    Among places that equally few honest agents see it takes those that the most adversaries see. Every agent
    outside the coalition counts as honest. A phantom that only adversaries see keeps its prior trust, and a
    local majority makes it trusted.

    max_honest   phantoms that more honest agents would see are left out; None: no limit
    """

    name = "fov_aware"

    def __init__(
        self,
        max_honest: int | None = None,
        n: int | None = None,
        start: int = 0,
        hit_rate: float | None = None,
        share: bool = True,
        motion: str = "static",
        speed: float | None = None,
        noise: float | None = None,
        suppress: float = 0.0,
    ):
        super().__init__(n, share, motion, speed, noise, hit_rate, start, suppress)
        self.max_honest = self.max_cost = whole_number_or_none(self.name, "max_honest", max_honest, 0, "no limit")

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        honest = scenario.n_agents - scenario.roles.count("adversary")
        return {"max_honest": Range(0, honest, whole=True, none=honest), **super().search_ranges(scenario, **given)}


class Lonely(HonestWitnesses):
    """Phantoms that no honest agent sees and as few adversaries as possible."""

    def prepare(self, context: PolicyContext) -> None:
        super().prepare(context)
        self.max_cost = len(context.agents)  # an honest witness costs more than all adversaries

    def cost(self, seen: dict[str, np.ndarray], points: np.ndarray) -> np.ndarray:
        return self.count_watchers(seen, points) + (len(self.context.agents) + 1) * super().cost(seen, points)

    def count_watchers(self, seen: dict[str, np.ndarray], points: np.ndarray) -> np.ndarray:
        """How many adversaries see points[w, G, Q, 2], int[w, G, Q]."""
        return self.seen_by_own(seen["pose"], points).sum(axis=1)


class Stealth(HonestWitnesses):
    """Phantoms that move like targets, with the noise of a sensor, through what adversaries see and no honest agent.

    All adversaries that can report a phantom do: as far as the centre can tell, it is a target.
    """

    name = "stealth"
    max_cost = 0

    def __init__(
        self,
        n: int | None = None,
        share: bool = True,
        motion: str = "pace",
        speed: float | None = None,
        noise: float | None = None,
        hit_rate: float | None = None,
        start: int = 0,
        suppress: float = 0.0,
    ):
        super().__init__(n, share, motion, speed, noise, hit_rate, start, suppress)


class Exclusive(Lonely):
    """False positives of every adversary where no honest agent looks and, if possible, no other adversary.

    A track that a single agent watches keeps its prior under defenses that compare agents.
    """

    name = "exclusive"
