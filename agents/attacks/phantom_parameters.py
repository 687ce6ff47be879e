"""The parameters that all attacks with phantoms share: checks, documentation, what a search may try."""

from __future__ import annotations

import inspect
from typing import Any

from trust_env.agents.attacks.motion import MOTIONS, target_speeds
from trust_env.agents.base import Policy
from trust_env.agents.parameters import (
    fraction_or_none,
    non_negative_or_none,
    one_of,
    true_or_false,
    whole_number,
    whole_number_or_none,
)
from trust_env.agents.search_ranges import (
    Range,
    SearchRanges,
    hit_rate_range,
    noise_range,
    phantom_range,
    start_range,
)
from trust_env.scenario import Scenario

# As `trust-env attacks show` explains them.
SHARED_PARAMETERS = {
    "n": "phantoms of each adversary; None: as many as it can report",
    "share": "True: phantoms, n in all, belong to the coalition: every adversary that can reports them",
    "motion": f"{' | '.join(MOTIONS)} (at constant speed, turning at the edge)",
    "speed": "m/s; None: drawn as for targets (over a recording: the tracker's initial velocity deviation)",
    "noise": "m, standard deviation of x and of y added to each report; None: the sensor's own noise",
    "hit_rate": "probability that an adversary reports its phantom in a frame; None: the sensor's P_D",
    "start": "frames to be honest first",
    "suppress": "fraction of the own detections withheld meanwhile, each by chance",
}


class PhantomParameters(Policy):
    """A policy with the parameters of phantoms; each attack has defaults of its own, and may leave some out."""

    unsearched = ("share",)
    reported_by_all: bool = False  # with share: whether every adversary has to have a slot for every phantom

    def __init__(
        self,
        n: int | None = None,
        share: bool = False,
        motion: str = "static",
        speed: float | None = None,
        noise: float | None = None,
        hit_rate: float | None = None,
        start: int = 0,
        suppress: float = 0.0,
    ):
        self.n = whole_number_or_none(self.name, "n", n, 1, "as many as one adversary can report")
        self.share = true_or_false(self.name, "share", share)
        self.motion = one_of(self.name, "motion", motion, MOTIONS)
        self.speed = non_negative_or_none(self.name, "speed", speed, "m/s", "as fast as targets")
        self.noise = non_negative_or_none(self.name, "noise", noise, "m", "the sensor's own noise")
        self.hit_rate = fraction_or_none(self.name, "hit_rate", hit_rate, "the sensor's P_D")
        self.start = whole_number(self.name, "start", start, 0)
        self.suppress = fraction_or_none(self.name, "suppress", suppress, "none") or 0.0

    def __init_subclass__(cls) -> None:
        """Add what the shared parameters mean to the documentation of the attack."""
        super().__init_subclass__()
        known = [name for name in inspect.signature(cls).parameters if name in SHARED_PARAMETERS]
        lines = [f"{name:<12} {SHARED_PARAMETERS[name]}" for name in known]
        if "name" in cls.__dict__:
            cls.__doc__ = "\n".join([inspect.cleandoc(cls.__doc__ or ""), "", *lines])

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        """Ranges of the parameters that the attack takes of those that attacks share."""
        parameters = inspect.signature(cls).parameters
        ranges: SearchRanges = {
            "n": phantom_range(scenario, cls.most_phantoms(scenario, **given)),
            "motion": MOTIONS,
            "speed": Range(0.0, 2.0 * target_speeds(scenario)[1]),
            "noise": noise_range(scenario),
            "hit_rate": hit_rate_range(scenario),
            "start": start_range(scenario),
            "suppress": Range(0.0, 1.0),
        }
        return {name: values for name, values in ranges.items() if name in parameters}

    @classmethod
    def most_phantoms(cls, scenario: Scenario, **given: Any) -> int:
        """How many phantoms the slots can ever hold: those of one adversary, with share those of all."""
        parameters = inspect.signature(cls).parameters
        share = given.get("share", parameters["share"].default if "share" in parameters else False)
        holders = scenario.roles.count("adversary") if share is True and not cls.reported_by_all else 1
        return scenario.injection.slots * max(1, holders)
