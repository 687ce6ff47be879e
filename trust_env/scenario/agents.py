"""Who takes part: the team, the agents' sensors, and what an agent may have different from the others."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from trust_env.scenario.errors import Problem
from trust_env.scenario.fov import Fov, FovType
from trust_env.scenario.types import (
    Count,
    Covariance,
    DetectionProbability,
    NonNegative,
    OpenProbability,
    Part,
    Point,
    Positive,
    Real,
    Size,
    raise_problems,
)

Role = Literal["adversary", "benign"]
Matrix = tuple[tuple[float, float], tuple[float, float]]


class Team(Part):
    """Who takes part when `agents` does not list them one by one."""

    n_adversaries: Count
    n_benign: Count
    order: Literal["adversaries_first", "adversaries_last"]
    placement: Literal["random", "overlapping", "together", "traffic"]
    spread: Positive  # m, radius of the disc of `overlapping`

    @property
    def roles(self) -> tuple[Role, ...]:
        adversaries: tuple[Role, ...] = ("adversary",) * self.n_adversaries
        benign: tuple[Role, ...] = ("benign",) * self.n_benign
        return adversaries + benign if self.order == "adversaries_first" else benign + adversaries


class Sensor(Part):
    """What is true of the sensors; what the centre believes of them stands in `tracker`."""

    p_detect: DetectionProbability
    sigma: Positive | None  # m, R = sigma^2 I
    noise_cov: Covariance | None  # m^2, R itself
    clutter_density: NonNegative  # false positives per m^2 and scan, inside the FOV
    max_detections: Size  # D

    @model_validator(mode="after")
    def _one_noise(self) -> Sensor:
        expected = "expected exactly one of sigma and noise_cov, the other null"
        if (self.sigma is None) == (self.noise_cov is None):
            raise_problems([Problem(("sigma",), self.sigma, expected)])
        if self.noise_cov is not None and (fault := covariance_fault(self.noise_cov)):
            raise_problems([Problem(("noise_cov",), self.noise_cov, fault)])
        return self

    @property
    def covariance(self) -> Matrix:
        """R [2, 2], m^2."""
        if self.noise_cov is not None:
            return self.noise_cov
        variance = (self.sigma or 0.0) ** 2
        return (variance, 0.0), (0.0, variance)


def covariance_fault(cov: Matrix) -> str:
    """Why a matrix is no covariance; empty when it is one."""
    (xx, xy), (yx, yy) = cov
    if abs(xy - yx) > 1e-12 * max(abs(xx), abs(yy)):
        return "expected a symmetric matrix"
    if xx <= 0 or yy <= 0 or xx * yy - xy * yx <= 0:
        return "expected a positive definite matrix: variances above 0, correlation within -1 and 1"
    return ""


class Belief(Part):
    """What the centre believes of an agent's sensor."""

    p_detect: OpenProbability
    beta_fp: Positive  # false positives per m^2
    beta_nt: Positive  # new targets per m^2


class Budget(Part):
    """How many injections and suppressions of an agent take effect in a frame."""

    injections: Count
    suppressions: Count


class FovDifference(Part):
    """What differs from the scenario's `fov`; null: the same."""

    type: FovType | None = None
    radius: Real | None = None
    heading: Real | None = None
    width: Real | None = None
    vertices: tuple[Point, ...] | None = None


class SensorDifference(Part):
    """What differs from the scenario's `sensor`; null: the same."""

    p_detect: DetectionProbability | None = None
    sigma: Positive | None = None
    noise_cov: Covariance | None = None
    clutter_density: NonNegative | None = None


class BeliefDifference(Part):
    """What the centre believes of this agent alone; null: as of all others."""

    p_detect: OpenProbability | None = None
    beta_fp: Positive | None = None
    beta_nt: Positive | None = None


class BudgetDifference(Part):
    """The agent's own budgets; null: that of its role."""

    injections: Count | None = None
    suppressions: Count | None = None


class AgentEntry(Part):
    """One agent as a scenario writes it; what is left out is the scenario's default."""

    role: Role
    position: Point | None = None  # m; null: placed by team.placement
    heading: Real = 0.0  # rad, counter-clockwise from the x axis
    fov: FovDifference | None = None
    sensor: SensorDifference | None = None
    belief: BeliefDifference | None = None
    budget: BudgetDifference | None = None


class Agent(Part):
    """One agent with everything filled in."""

    name: str
    role: Role
    position: Point | None  # m; None: drawn at every reset
    heading: Real  # rad, counter-clockwise from the x axis
    fov: Fov
    sensor: Sensor
    belief: Belief
    budget: Budget
