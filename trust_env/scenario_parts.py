"""The parts of a scenario: each model is one mapping of `scenarios/base.yaml`, which holds the defaults.

Lengths in metres, times in seconds, angles in radians, rates per frame, densities per square metre.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from trust_env.scenario_errors import Problem


def _number(value: Any) -> Any:
    # YAML's `yes` and quoted digits would otherwise pass for numbers.
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise PydanticCustomError("number", "expected a number")
    return value


def _list_of(count: int, content: str) -> BeforeValidator:
    def check(value: Any) -> Any:
        if not isinstance(value, (list, tuple)) or len(value) != count:
            raise PydanticCustomError(
                "list_length", "expected a list of {count} {content}", {"count": count, "content": content}
            )
        return value

    return BeforeValidator(check)


Real = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Positive = Annotated[Real, Field(gt=0)]
NonNegative = Annotated[Real, Field(ge=0)]
Probability = Annotated[Real, Field(ge=0, le=1)]
OpenProbability = Annotated[Real, Field(gt=0, lt=1)]
Whole = Annotated[int, BeforeValidator(_number)]
Count = Annotated[Whole, Field(ge=0)]
Size = Annotated[Whole, Field(ge=1)]
Point = Annotated[tuple[Real, Real], _list_of(2, "numbers [x, y]")]
Area = Annotated[tuple[Real, Real, Real, Real], _list_of(4, "numbers [x_min, x_max, y_min, y_max]")]
Covariance = Annotated[tuple[Point, Point], _list_of(2, "rows [[xx, xy], [xy, yy]]")]

Role = Literal["adversary", "benign"]


def refuse(problems: list[Problem]) -> None:
    """Raise what a validator found; `problems_of` unpacks it."""
    if problems:
        raise PydanticCustomError("inconsistent", "inconsistent fields", {"problems": problems})


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


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


class Fov(Part):
    """Field of view about the agent; only the fields of its `type` count."""

    type: Literal["circle", "sector", "polygon"]
    radius: Real  # m
    heading: Real  # rad, middle of the sector, from the agent's own heading
    width: Real  # rad, total opening of the sector
    vertices: tuple[Point, ...] | None  # m, in the agent's frame (x ahead, y left)

    @model_validator(mode="after")
    def _sees_something(self) -> Fov:
        problems = []
        if self.type != "polygon" and self.radius <= 0:
            problems.append(
                Problem(("radius",), self.radius, "expected a number above 0, or the FOV sees nothing")
            )
        if self.type == "sector" and not 0 < self.width <= 2 * math.pi:
            text = "expected radians above 0 (or the FOV sees nothing) and at most 2 pi = 6.283185307179586"
            problems.append(Problem(("width",), self.width, text))
        if self.type == "polygon":
            problems += [
                Problem(("vertices",), self.vertices, text) for text in polygon_faults(self.vertices)
            ]
        refuse(problems)
        return self

    @property
    def area(self) -> float:
        """m^2; what the expected amount of clutter is proportional to."""
        if self.type == "circle":
            return math.pi * self.radius**2
        if self.type == "sector":
            return self.width * self.radius**2 / 2
        return abs(signed_area(self.vertices or ()))


def signed_area(vertices: tuple[tuple[float, float], ...]) -> float:
    """Shoelace formula; m^2, positive when counter-clockwise."""
    following = vertices[1:] + vertices[:1]
    return sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in zip(vertices, following, strict=True)) / 2


def polygon_faults(vertices: tuple[tuple[float, float], ...] | None) -> list[str]:
    """Why the vertices, in either orientation, do not enclose a convex polygon; empty when they do."""
    if vertices is None or len(vertices) < 3:
        return ["expected at least 3 vertices [x, y], or the FOV sees nothing"]
    edges = [
        (x1 - x0, y1 - y0) for (x0, y0), (x1, y1) in zip(vertices, vertices[1:] + vertices[:1], strict=True)
    ]
    if (0.0, 0.0) in edges:
        return ["expected vertices that differ from their neighbours"]
    if abs(signed_area(vertices)) < 1e-12 * max(math.hypot(*e) for e in edges) ** 2:
        return ["expected an area above 0, or the FOV sees nothing"]
    turns = [_turn(a, b) for a, b in zip(edges, edges[1:] + edges[:1], strict=True)]
    # A star turns the same way at each corner too, but more than once around.
    one_way = all(t >= -1e-9 for t in turns) or all(t <= 1e-9 for t in turns)
    return (
        []
        if one_way and abs(abs(sum(turns)) - 2 * math.pi) < 1e-6
        else ["expected the corners of a convex polygon, in order"]
    )


def _turn(a: tuple[float, float], b: tuple[float, float]) -> float:
    return math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])


class Sensor(Part):
    """What is true of the sensors; what the centre believes of them stands in `tracker`."""

    p_detect: Annotated[Real, Field(gt=0, le=1)]
    sigma: Positive | None  # m, R = sigma^2 I
    noise_cov: Covariance | None  # m^2, R itself
    clutter_density: NonNegative  # false positives per m^2 and scan, inside the FOV
    max_detections: Size  # D

    @model_validator(mode="after")
    def _one_noise(self) -> Sensor:
        if (self.sigma is None) == (self.noise_cov is None):
            both = f"{self.sigma} and noise_cov = {self.noise_cov}" if self.sigma else None
            refuse([Problem(("sigma",), both, "expected exactly one of sigma and noise_cov")])
        refuse([Problem(("noise_cov",), self.noise_cov, text) for text in covariance_faults(self.noise_cov)])
        return self

    @property
    def covariance(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """R[2, 2], m^2."""
        if self.noise_cov is not None:
            return self.noise_cov
        variance = (self.sigma or math.nan) ** 2
        return (variance, 0.0), (0.0, variance)


def covariance_faults(cov: tuple[tuple[float, float], tuple[float, float]] | None) -> list[str]:
    if cov is None:
        return []
    (xx, xy), (yx, yy) = cov
    if abs(xy - yx) > 1e-12 * max(abs(xx), abs(yy)):
        return ["expected a symmetric matrix"]
    if xx <= 0 or xx * yy - xy * yx <= 0:
        return ["expected a positive definite matrix (variances above 0, |correlation| below 1)"]
    return []


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
    """What an agent's FOV has different from the scenario's `fov`; null: the same."""

    type: Literal["circle", "sector", "polygon"] | None = None
    radius: Real | None = None
    heading: Real | None = None
    width: Real | None = None
    vertices: tuple[Point, ...] | None = None


class SensorDifference(Part):
    """What an agent's sensor has different from the scenario's `sensor`; null: the same."""

    p_detect: Annotated[Real, Field(gt=0, le=1)] | None = None
    sigma: Positive | None = None
    noise_cov: Covariance | None = None
    clutter_density: NonNegative | None = None


class BeliefDifference(Part):
    """What the centre believes of this agent alone; null: as of all others."""

    p_detect: OpenProbability | None = None
    beta_fp: Positive | None = None
    beta_nt: Positive | None = None


class BudgetDifference(Part):
    """An agent's own budgets; null: that of its role."""

    injections: Count | None = None
    suppressions: Count | None = None


class AgentEntry(Part):
    """One agent as the scenario writes it; what is left out is the scenario's default."""

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
    heading: float  # rad
    fov: Fov
    sensor: Sensor
    belief: Belief
    budget: Budget


class InjectionRules(Part):
    slots: Count  # M
    adversary: Count | None  # budget per frame; null: all slots
    benign: Count | None


class SuppressionRules(Part):
    adversary: Count | None  # budget per frame; null: all detections
    benign: Count | None


class CaseInjection(Part):
    """A false positive that belongs to the case: the agent that reports it, and where."""

    agent: Count
    position: Point  # m


class Targets(Part):
    slots: Count  # N
    initial: Probability  # that a slot is filled at reset
    birth_rate: Probability  # per frame and empty slot
    death_rate: Probability  # per frame and target
    speed: Annotated[tuple[NonNegative, NonNegative], _list_of(2, "numbers [min, max]")]  # m/s
    process_noise: NonNegative  # m^2/s^3
    positions: tuple[Point, ...] | None  # m
    velocities: tuple[Point, ...] | None  # m/s
    data: str | None  # path of a CSV file

    @model_validator(mode="after")
    def _agree(self) -> Targets:
        problems = []
        if self.speed[0] > self.speed[1]:
            problems.append(Problem(("speed",), list(self.speed), "expected [min, max] with min <= max"))
        if self.velocities is not None and len(self.velocities) != len(self.positions or ()):
            text = f"expected one velocity per position ({len(self.positions or ())})"
            problems.append(Problem(("velocities",), self.velocities, text))
        if self.positions is not None and self.data is not None:
            problems.append(Problem(("data",), self.data, "expected null, as positions are given"))
        refuse(problems)
        return self


class Tracker(Part):
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
    def _agree(self) -> Tracker:
        problems = []
        if self.confirm_m > self.confirm_n:
            text = f"expected at most confirm_n ({self.confirm_n})"
            problems.append(Problem(("confirm_m",), self.confirm_m, text))
        if self.alpha + self.beta >= 1:
            problems.append(
                Problem(("beta",), self.beta, f"expected alpha + beta below 1 (alpha is {self.alpha})")
            )
        refuse(problems)
        return self


class EvidenceRules(Part):
    near_distance: Positive | None  # m; null: the gate alone decides
    hold_distance: Positive  # m


class Reward(Part):
    false_track: Real
    missing_target: Real
    lost_trust: Real


class Metrics(Part):
    match_distance: Positive  # m
    cutoff: Positive  # m, c of GOSPA and OSPA
    order: Annotated[Real, Field(ge=1)]  # p
    alpha: Annotated[Real, Field(gt=0, le=2)]
    accuse_below: Probability
