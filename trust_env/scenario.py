"""The description of worlds: types, bounds and errors. Every default stands in `scenarios/base.yaml`, and only there."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import yaml
from pydantic import ValidationError, model_validator

from trust_env import scenario_checks
from trust_env.scenario_errors import Origins, ScenarioError, problems_of
from trust_env.scenario_loading import Layer, apply_overrides, plain, read_source, scenarios
from trust_env.scenario_parts import (
    Agent,
    AgentEntry,
    Area,
    Belief,
    Budget,
    CaseInjection,
    EvidenceRules,
    Fov,
    InjectionRules,
    Metrics,
    Part,
    Point,
    Positive,
    Reward,
    Role,
    Sensor,
    Size,
    SuppressionRules,
    Targets,
    Team,
    Tracker,
    refuse,
)
from trust_env.scenario_recorded import fill_from_recording, traffic_centres

if TYPE_CHECKING:
    from trust_env.recording import Recording

__all__ = ["Agent", "Fov", "Scenario", "ScenarioError", "load_scenario", "scenarios"]


class Scenario(Part):
    """A scenario with every field filled in; made by `load_scenario`, documented field by field in `base.yaml`."""

    name: str
    description: str
    dt: Positive  # s
    horizon: Size  # frames
    knowledge: Literal["own", "poses", "picture", "white_box"]
    coordination: Literal["none", "shared"]
    actuation: Literal["monitor", "filter", "remove", "weight"]
    area: Area  # m
    agents: tuple[AgentEntry, ...] | None
    team: Team
    fov: Fov
    sensor: Sensor
    injection: InjectionRules
    suppression: SuppressionRules
    injections: tuple[CaseInjection, ...]
    targets: Targets
    tracker: Tracker
    evidence: EvidenceRules
    reward: Reward
    metrics: Metrics

    @model_validator(mode="after")
    def _agree(self) -> Scenario:
        # What the agents are made of comes first: the other checks need agents that can be resolved.
        refuse(scenario_checks.agent_problems(self))
        refuse(scenario_checks.problems(self))
        return self

    @property
    def n_agents(self) -> int:
        """K."""
        return len(self.roles)

    @property
    def roles(self) -> tuple[Role, ...]:
        """Role of each agent, [K]."""
        return self.team.roles if self.agents is None else tuple(entry.role for entry in self.agents)

    @property
    def agent_names(self) -> tuple[str, ...]:
        """`adversary_0`, `benign_0`, ...: counted per role, in the order of the agents."""
        roles = self.roles
        return tuple(f"{role}_{roles[:k].count(role)}" for k, role in enumerate(roles))

    def agent(self, k: int) -> Agent:
        """Agent k with everything filled in from the scenario's defaults."""
        entry = self.agents[k] if self.agents is not None else AgentEntry(role=self.roles[k])
        sensor = self.sensor_of(entry)
        return Agent(
            name=self.agent_names[k],
            role=entry.role,
            position=entry.position or self._placed(k),
            heading=entry.heading,
            fov=self.fov_of(entry),
            sensor=sensor,
            belief=self._belief(entry, sensor),
            budget=self._budget(entry),
        )

    def fov_of(self, entry: AgentEntry) -> Fov:
        return Fov.model_validate(_with_difference(self.fov, entry.fov))

    def sensor_of(self, entry: AgentEntry) -> Sensor:
        return Sensor.model_validate(_with_difference(self.sensor, entry.sensor))

    def _belief(self, entry: AgentEntry, sensor: Sensor) -> Belief:
        beta_fp = self.tracker.beta_fp or sensor.clutter_density
        beta_fp = (entry.belief and entry.belief.beta_fp) or beta_fp
        beta_nt = (entry.belief and entry.belief.beta_nt) or self.tracker.beta_nt or 1e-3 * beta_fp
        p_detect = (entry.belief and entry.belief.p_detect) or self.tracker.p_detect
        return Belief(p_detect=p_detect, beta_fp=beta_fp, beta_nt=beta_nt)

    def _budget(self, entry: AgentEntry) -> Budget:
        injections, suppressions = getattr(self.injection, entry.role), getattr(self.suppression, entry.role)
        if entry.budget is not None:
            injections = injections if entry.budget.injections is None else entry.budget.injections
            suppressions = suppressions if entry.budget.suppressions is None else entry.budget.suppressions
        return Budget(
            injections=self.injection.slots if injections is None else injections,
            suppressions=self.sensor.max_detections if suppressions is None else suppressions,
        )

    def _placed(self, k: int) -> Point | None:
        x_min, x_max, y_min, y_max = self.area
        if self.team.placement == "together":
            return (x_min + x_max) / 2, (y_min + y_max) / 2
        recording = self.recording() if self.team.placement == "traffic" else None
        return traffic_centres(recording, self.n_agents)[k] if recording is not None else None

    def recording(self) -> Recording | None:
        """The recorded trajectories on the grid of `dt`, or None when targets are simulated."""
        if self.targets.data is None:
            return None
        from trust_env.recording import cached_recording

        return cached_recording(self.targets.data, self.dt)

    def to_yaml(self) -> str:
        """The whole scenario as YAML that `load_scenario` reads back."""
        return yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False, width=110, allow_unicode=True)


def _with_difference(default: Part, difference: Part | None) -> dict[str, Any]:
    own = difference.model_dump(exclude_none=True) if difference is not None else {}
    other = {"sigma": "noise_cov", "noise_cov": "sigma"}
    own |= {other[name]: None for name in own if name in other and other[name] not in own}
    return {**default.model_dump(), **own}


def load_scenario(source: str | Path | Mapping[str, Any] | Scenario = "patrol", /, **overrides: Any) -> Scenario:
    """A scenario from a built-in name, `patrol(horizon=50)`, a path ending in .yaml, a mapping or another scenario.

    Overrides name a field by dotted path (`**{"tracker.gate": 0.95}`) or by a last name that fits one field only
    (`gate=0.95`). `ScenarioError`, a ValueError, lists everything that is wrong.
    """
    if isinstance(source, Scenario):
        layer = Layer(source.model_dump(), Origins(source.name))
    else:
        layer = read_source(source, Scenario)
    layer = fill_from_recording(apply_overrides(layer, overrides, Scenario))
    try:
        return Scenario.model_validate(plain(layer.fields))
    except ValidationError as error:
        raise layer.origins.error(problems_of(error, Scenario)) from None
