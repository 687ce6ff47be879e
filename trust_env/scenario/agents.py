"""The agents of a scenario: the team, sensors, beliefs and budgets, and how single agents differ."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from trust_env.scenario.errors import Problem
from trust_env.scenario.fov import Fov, FovDifference
from trust_env.scenario.types import (
    MAX_AGENTS,
    VARIANCE,
    AgentCount,
    Angle,
    BirthDensity,
    Count,
    Covariance,
    Density,
    DensityOrNone,
    DetectionCount,
    DetectionProbability,
    Length,
    OpenProbability,
    Part,
    Point,
    raise_problems,
)

Role = Literal["adversary", "benign"]
PlatformName = Annotated[str, Field(min_length=1, max_length=200)]
Matrix = tuple[tuple[float, float], tuple[float, float]]
_MAX_CORRELATION = 0.999999  # of the noise: nearer to 1 rounding decides whether a matrix is a covariance


class Team(Part):
    """The agents when `agents` does not list them one by one."""

    n_adversaries: AgentCount
    n_benign: AgentCount
    order: Literal["adversaries_first", "adversaries_last"]
    placement: Literal["random", "overlapping", "together", "traffic"]
    spread: Length  # m, radius of the disc of `overlapping`
    platforms: Annotated[tuple[PlatformName, ...], Field(max_length=MAX_AGENTS)] | None  # [K]

    @property
    def roles(self) -> tuple[Role, ...]:
        adversaries: tuple[Role, ...] = ("adversary",) * self.n_adversaries
        benign: tuple[Role, ...] = ("benign",) * self.n_benign
        return adversaries + benign if self.order == "adversaries_first" else benign + adversaries


class Sensor(Part):
    """The sensors as they are; what the centre believes of them is in `tracker`."""

    p_detect: DetectionProbability
    sigma: Length | None  # m, R = sigma^2 I
    noise_cov: Covariance | None  # m^2, R itself
    clutter_density: DensityOrNone  # false positives per m^2 and scan, inside the FOV
    max_detections: DetectionCount  # D
    resolution: Length | None  # m, detections of a report nearer than this are one

    @model_validator(mode="after")
    def _consistent(self) -> Sensor:
        expected = "expected exactly one of sigma and noise_cov, the other null"
        if (self.sigma is None) == (self.noise_cov is None):
            raise_problems([Problem(("sigma",), self.sigma, expected, (("noise_cov",),))])
        if self.noise_cov is not None and (fault := _expected_covariance(self.noise_cov)):
            raise_problems([Problem(("noise_cov",), self.noise_cov, fault)])
        return self

    @property
    def covariance(self) -> Matrix:
        """R [2, 2], m^2."""
        if self.noise_cov is not None:
            return self.noise_cov
        variance = (self.sigma or 0.0) ** 2
        return (variance, 0.0), (0.0, variance)


def _expected_covariance(cov: Matrix) -> str:
    """What a matrix lacks of a covariance; empty when it is one."""
    (xx, xy), (yx, yy) = cov
    if abs(xy - yx) > 1e-12 * max(abs(xx), abs(yy)):
        return "expected a symmetric matrix"
    if xx <= 0 or yy <= 0 or xx * yy - xy * yx <= 0:
        return "expected a positive definite matrix: variances above 0, correlation within -1 and 1"
    if min(xx, yy) < VARIANCE.least:
        return f"expected variances from {VARIANCE.least:g} to {VARIANCE.most:g}"
    if xy * xy > _MAX_CORRELATION**2 * xx * yy:
        return f"expected a correlation within -{_MAX_CORRELATION:g} and {_MAX_CORRELATION:g}"
    return ""


class Belief(Part):
    """What the centre believes of an agent's sensor."""

    p_detect: OpenProbability
    beta_fp: Density  # false positives per m^2
    beta_nt: BirthDensity  # new targets per m^2
    compromised: OpenProbability | None  # prior probability that the agent is; None: left to the defense


class Budget(Part):
    """The injections and suppressions of an agent that take effect in a frame, at most."""

    injections: Count
    suppressions: Count


class SensorDifference(Part):
    """Fields that differ from the scenario's `sensor`; null: the same."""

    p_detect: DetectionProbability | None = None
    sigma: Length | None = None
    noise_cov: Covariance | None = None
    clutter_density: DensityOrNone | None = None
    resolution: Length | None = None


class BeliefDifference(Part):
    """Fields that differ from what the centre believes of all agents; null: the same."""

    p_detect: OpenProbability | None = None
    beta_fp: Density | None = None
    beta_nt: BirthDensity | None = None
    compromised: OpenProbability | None = None


class BudgetDifference(Part):
    """Budgets that differ from those of the agent's role; null: the same."""

    injections: Count | None = None
    suppressions: Count | None = None


class AgentEntry(Part):
    """One agent as a scenario lists it."""

    role: Role
    platform: PlatformName | None = None  # type of the agent's platform; null: like no other
    position: Point | None = None  # m; null: placed by team.placement
    heading: Angle = 0.0  # rad, counter-clockwise from the x axis
    fov: FovDifference | None = None
    sensor: SensorDifference | None = None
    belief: BeliefDifference | None = None
    budget: BudgetDifference | None = None


class Agent(Part):
    """One agent with all its fields resolved."""

    name: str
    role: Role
    platform: str | None  # its type; None: like no other
    position: Point | None  # m; None: drawn at every reset
    heading: Angle  # rad, counter-clockwise from the x axis
    fov: Fov
    sensor: Sensor
    belief: Belief
    budget: Budget
