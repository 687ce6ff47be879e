"""Parts of a scenario other than agents; `builtin/base.yaml` explains every field and has its default."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from trust_env.scenario.errors import Problem
from trust_env.scenario.types import (
    Count,
    NonNegative,
    OpenProbability,
    Part,
    Point,
    Positive,
    Probability,
    Range,
    Real,
    Size,
    raise_problems,
)


class InjectionRules(Part):
    """False positives that agents may add to their reports."""

    slots: Count  # M
    adversary: Count | None  # budget per frame; null: all slots
    benign: Count | None


class SuppressionRules(Part):
    """Own detections that agents may withhold."""

    adversary: Count | None  # budget per frame; null: all detections
    benign: Count | None


class CaseInjection(Part):
    """A false positive that belongs to the scenario: the agent that reports it, and its position."""

    agent: Count
    position: Point  # m


class Targets(Part):
    """Simulated targets, targets with fixed starts, or recorded ones."""

    slots: Count  # N
    initial: Probability  # that a slot is filled at reset
    birth_rate: Probability  # per frame and empty slot
    death_rate: Probability  # per frame and target
    speed: Range  # m/s
    process_noise: NonNegative  # m^2/s^3
    positions: tuple[Point, ...] | None  # m
    velocities: tuple[Point, ...] | None  # m/s
    data: str | None  # path of a CSV file

    @model_validator(mode="after")
    def _consistent(self) -> Targets:
        problems: list[Problem] = []
        if self.speed[0] > self.speed[1]:
            problems.append(Problem(("speed",), list(self.speed), "expected [min, max] with min <= max"))
        if self.velocities is not None and len(self.velocities) != len(self.positions or ()):
            text = f"expected one velocity per position ({len(self.positions or ())})"
            problems.append(Problem(("velocities",), self.velocities, text))
        if self.positions is not None and self.data is not None:
            problems.append(Problem(("data",), self.data, "expected null, as positions are given"))
        raise_problems(problems)
        return self


class Tracker(Part):
    """The central tracker and what it believes; the agents' local trackers are the same."""

    p_detect: OpenProbability
    beta_fp: Positive | None  # per m^2; null: the sensor's clutter density
    beta_nt: Positive | None  # per m^2; null: 1e-3 beta_fp
    process_noise: NonNegative  # m^2/s^3
    initial_velocity_variance: Positive  # (m/s)^2
    gate: OpenProbability
    alpha: OpenProbability
    beta: OpenProbability
    confirmation: Literal["score", "m_of_n", "score_or_hits"]
    confirm_m: Size
    confirm_n: Annotated[Size, Field(le=32)]
    confirm_hits: Size
    deletion: Literal["drop", "relative", "absolute"]
    confirmed_drop: Positive  # nats
    tentative_drop: Positive  # nats
    max_unseen: Size  # frames
    max_tracks: Size  # J
    max_local_tracks: Size  # L

    @model_validator(mode="after")
    def _consistent(self) -> Tracker:
        problems: list[Problem] = []
        if self.confirm_m > self.confirm_n:
            text = f"expected at most confirm_n ({self.confirm_n})"
            problems.append(Problem(("confirm_m",), self.confirm_m, text))
        if self.alpha + self.beta >= 1:
            text = f"expected alpha + beta below 1 (alpha is {self.alpha})"
            problems.append(Problem(("beta",), self.beta, text))
        raise_problems(problems)
        return self


class EvidenceRules(Part):
    """Distances at which an agent counts as detecting or as holding a track."""

    near_distance: Positive | None  # m; null: the gate alone decides
    hold_distance: Positive  # m


class Reward(Part):
    """Weights of an adversary's reward."""

    false_track: Real
    missing_target: Real
    lost_trust: Real


class Metrics(Part):
    """Parameters of the metrics."""

    match_distance: Positive  # m
    cutoff: Positive  # m, c of GOSPA and OSPA
    order: Annotated[Real, Field(ge=1)]  # p
    accuse_below: Probability
