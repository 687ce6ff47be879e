"""When an attack happens: policies around an inner one, which acts in some frames only."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from trust_env.agents.base import Policy, PolicyContext, PolicyLike
from trust_env.agents.knowledge import knowledge_of
from trust_env.agents.parameters import fraction, invalid, whole_number
from trust_env.agents.search_ranges import Range, SearchRanges, half_episode, start_range
from trust_env.scenario import Scenario


class Timed(Policy):
    """Actions of an inner policy, which sees every frame, in the frames of `attacks`; zeros in the others."""

    policy_parameters = ("inner",)

    def __init__(self, inner: Any):
        if not isinstance(inner, PolicyLike):
            raise invalid(self.name, "inner", inner, f"a policy; build_policy('{self.name}(...)') takes names")
        self.inner = inner
        self.knowledge = knowledge_of(inner)

    def reset(self, context: PolicyContext) -> None:
        super().reset(context)
        self.inner.reset(context)

    def act(self, observations: np.ndarray) -> np.ndarray:
        actions = np.where(self.attacks()[:, None, None], self.inner.act(observations), np.float32(0.0))
        self.frame += 1
        return actions

    @property
    def missing_phantoms(self) -> np.ndarray | None:
        """Those of the inner policy."""
        return getattr(self.inner, "missing_phantoms", None)

    def attacks(self) -> np.ndarray:
        """In which worlds the inner policy acts in the present frame, bool[W]."""
        raise NotImplementedError


class Sleeper(Timed):
    """Honest for the first `start` frames, to build up trust, then an inner attack.

    start        frames to be honest first
    inner        the attack, by its name: false_positive, suppress(choice=all)
    """

    name = "sleeper"

    def __init__(self, start: int = 50, inner: Any = "false_positive"):
        self.start = whole_number(self.name, "start", start, 0)
        super().__init__(inner)

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        return {"start": start_range(scenario)}

    def attacks(self) -> np.ndarray:
        return self.frame >= self.start


class OnOff(Timed):
    """An inner attack in the first `duty` of every `period` frames, honest in the rest of them.

    duty         fraction of the period, above 0 and at most 1; rounded up to whole frames
    period       frames
    inner        the attack, by its name: false_positive, suppress(choice=all)
    """

    name = "on_off"

    def __init__(self, duty: float = 0.5, period: int = 20, inner: Any = "false_positive"):
        self.duty = fraction(self.name, "duty", duty)
        self.period = whole_number(self.name, "period", period, 1)
        super().__init__(inner)

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        return {"duty": Range(0.05, 1.0), "period": Range(2, half_episode(scenario), whole=True)}

    def attacks(self) -> np.ndarray:
        return self.frame % self.period < math.ceil(self.duty * self.period - 1e-9)
