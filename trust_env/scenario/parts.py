"""Parts of a scenario other than agents; `builtin/base.yaml` explains every field and has its default."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import model_validator

from trust_env.scenario.errors import Problem
from trust_env.scenario.types import (
    MAX_AGENTS,
    MAX_ITEMS,
    BirthDensity,
    Count,
    Density,
    Frames,
    Length,
    Nats,
    OpenProbability,
    Order,
    Part,
    Point,
    Points,
    Probability,
    ProcessNoise,
    SpeedRange,
    TargetCount,
    TrackCount,
    Variance,
    Weight,
    Whole,
    Within,
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

    agent: Annotated[Whole, Within(0, MAX_AGENTS - 1)]
    position: Point  # m


class CaseSuppression(Part):
    """A false negative that belongs to the scenario: the agent that keeps silent, and about which target."""

    agent: Annotated[Whole, Within(0, MAX_AGENTS - 1)]
    target: Annotated[Whole, Within(0, MAX_ITEMS - 1)]  # its place in `targets.positions`


class Targets(Part):
    """Simulated targets, targets with fixed starts, or recorded ones."""

    slots: TargetCount  # N
    initial: Probability  # that a slot is filled at reset
    birth_rate: Probability  # per frame and empty slot
    death_rate: Probability  # per frame and target
    speed: SpeedRange  # m/s
    process_noise: ProcessNoise  # m^2/s^3
    positions: Points | None  # m
    velocities: Points | None  # m/s
    data: str | None  # path of a CSV file

    @model_validator(mode="after")
    def _consistent(self) -> Targets:
        problems: list[Problem] = []
        if self.speed[0] > self.speed[1]:
            problems.append(Problem(("speed",), list(self.speed), "expected [min, max] with min <= max"))
        if self.velocities is not None and len(self.velocities) != len(self.positions or ()):
            text = f"expected one velocity per position ({len(self.positions or ())})"
            problems.append(Problem(("velocities",), self.velocities, text, (("positions",),)))
        if self.positions is not None and self.data is not None:
            problems.append(Problem(("data",), self.data, "expected null, as positions are given", (("positions",),)))
        raise_problems(problems)
        return self


class Tracker(Part):
    """The central tracker and what it believes; the agents' local trackers are the same."""

    p_detect: OpenProbability
    beta_fp: Density | None  # per m^2; null: the sensor's clutter density
    beta_nt: BirthDensity | None  # per m^2; null: 1e-3 beta_fp
    process_noise: ProcessNoise  # m^2/s^3
    initial_velocity_variance: Variance  # (m/s)^2
    gate: OpenProbability
    fusion: Literal["sequential", "trimmed_mean", "residual_clique", "secure_estimate"]
    fusion_tolerance: Annotated[Whole, Within(0, MAX_AGENTS)]  # l, wrong hits of a track
    alpha: OpenProbability
    beta: OpenProbability
    confirmation: Literal["score", "m_of_n", "score_or_hits"]
    confirm_m: Annotated[Whole, Within(1, 32)]
    confirm_n: Annotated[Whole, Within(1, 32)]
    confirm_hits: Frames
    deletion: Literal["drop", "relative", "absolute"]
    confirmed_drop: Nats  # nats
    tentative_drop: Nats  # nats
    max_unseen: Frames  # frames
    max_tracks: TrackCount  # J
    max_local_tracks: TrackCount  # L

    @model_validator(mode="after")
    def _consistent(self) -> Tracker:
        problems: list[Problem] = []
        if self.confirm_m > self.confirm_n:
            text = f"expected at most confirm_n ({self.confirm_n})"
            problems.append(Problem(("confirm_m",), self.confirm_m, text, (("confirm_n",),)))
        if self.alpha + self.beta >= 1:
            text = f"expected alpha + beta below 1 (alpha is {self.alpha})"
            problems.append(Problem(("beta",), self.beta, text, (("alpha",),)))
        raise_problems(problems)
        return self


class EvidenceRules(Part):
    """Distances at which an agent counts as detecting or as holding a track."""

    near_distance: Length | None  # m; null: the gate alone decides
    hold_distance: Length  # m


class Reward(Part):
    """Weights of an adversary's reward."""

    false_track: Weight
    missing_target: Weight
    lost_trust: Weight


class Metrics(Part):
    """Parameters of the metrics."""

    match_distance: Length  # m
    cutoff: Length  # m, c of GOSPA and OSPA
    order: Order  # p
    accuse_below: Probability
    accuse_frames: Frames
