"""The fields of a scenario, and the agents that follow from them; `builtin/base.yaml` has every default."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from trust_env.scenario.agents import Agent, AgentEntry, Belief, Budget, Role, Sensor, Team
from trust_env.scenario.fov import Fov
from trust_env.scenario.parts import (
    CaseInjection,
    CaseSuppression,
    EvidenceRules,
    InjectionRules,
    Metrics,
    Reward,
    SuppressionRules,
    Targets,
    Tracker,
)
from trust_env.scenario.recording import Recording, cached_recording
from trust_env.scenario.traffic import traffic_centres
from trust_env.scenario.types import MAX_AGENTS, MAX_ITEMS, Area, Duration, Frames, Part, Point, Whole, Within


class ScenarioFields(Part):
    """All fields of a scenario, each within its own bounds; `builtin/base.yaml` explains each."""

    name: Annotated[str, Field(max_length=200)]
    description: Annotated[str, Field(max_length=10_000)]
    dt: Duration  # s
    horizon: Frames  # frames
    knowledge: Literal["own", "poses", "picture", "white_box"]
    coordination: Literal["none", "shared"]
    actuation: Literal["monitor", "filter", "remove", "weight", "retro"]
    retro_window: Annotated[Whole, Within(1, 1000)]  # frames
    area: Area  # m
    agents: Annotated[tuple[AgentEntry, ...], Field(max_length=MAX_AGENTS)] | None
    team: Team
    fov: Fov
    sensor: Sensor
    injection: InjectionRules
    suppression: SuppressionRules
    injections: Annotated[tuple[CaseInjection, ...], Field(max_length=MAX_ITEMS)]
    suppressions: Annotated[tuple[CaseSuppression, ...], Field(max_length=MAX_ITEMS)]
    targets: Targets
    tracker: Tracker
    evidence: EvidenceRules
    reward: Reward
    metrics: Metrics

    @property
    def entries(self) -> tuple[AgentEntry, ...]:
        """The agents as listed, or as the team makes them; [K]."""
        if self.agents is not None:
            return self.agents
        platforms = self.team.platforms or (None,) * len(self.team.roles)
        return tuple(AgentEntry(role=r, platform=p) for r, p in zip(self.team.roles, platforms, strict=True))

    @property
    def n_agents(self) -> int:
        """K."""
        return len(self.entries)

    @property
    def roles(self) -> tuple[Role, ...]:
        """[K]"""
        return tuple(entry.role for entry in self.entries)

    @property
    def platforms(self) -> tuple[int, ...]:
        """Numbers of the agents' platform types in the order in which they are named, -1 for none; [K]."""
        named = [entry.platform for entry in self.entries]
        types = list(dict.fromkeys(name for name in named if name is not None))
        return tuple(-1 if name is None else types.index(name) for name in named)

    @property
    def agent_names(self) -> tuple[str, ...]:
        """`adversary_0`, `benign_0`, ...: counted per role, in the order of the agents; [K]."""
        return tuple(f"{role}_{self.roles[:k].count(role)}" for k, role in enumerate(self.roles))

    def agent(self, k: int) -> Agent:
        """Agent k with all its fields resolved."""
        entry = self.entries[k]
        return Agent(
            name=self.agent_names[k],
            role=entry.role,
            platform=entry.platform,
            position=self._position_of(k) if entry.position is None else entry.position,
            heading=entry.heading,
            fov=self.fov_of(entry),
            sensor=self.sensor_of(entry),
            belief=self.belief_of(entry),
            budget=self.budget_of(entry),
        )

    def fov_of(self, entry: AgentEntry) -> Fov:
        return Fov.model_validate(_apply_difference(self.fov, entry.fov))

    def sensor_of(self, entry: AgentEntry) -> Sensor:
        return Sensor.model_validate(_apply_difference(self.sensor, entry.sensor))

    def belief_of(self, entry: AgentEntry) -> Belief:
        """What the centre believes of the agent, else of all agents, else its true clutter density."""
        believed = _apply_difference(self.tracker, entry.belief)
        beta_fp = believed["beta_fp"] or self.sensor_of(entry).clutter_density
        beta_nt = believed["beta_nt"] or 1e-3 * beta_fp
        compromised = None if entry.belief is None else entry.belief.compromised
        return Belief(p_detect=believed["p_detect"], beta_fp=beta_fp, beta_nt=beta_nt, compromised=compromised)

    def budget_of(self, entry: AgentEntry) -> Budget:
        """The agent's own budget, else that of its role, within the slots there are."""
        role = {
            "injections": getattr(self.injection, entry.role),
            "suppressions": getattr(self.suppression, entry.role),
        }
        own = role if entry.budget is None else role | entry.budget.model_dump(exclude_none=True)
        slots = {"injections": self.injection.slots, "suppressions": self.sensor.max_detections}
        return Budget(**{name: most if own[name] is None else min(own[name], most) for name, most in slots.items()})

    def _position_of(self, k: int) -> Point | None:
        """m, the position of agent k by `team.placement`; None when every reset draws it."""
        x_min, x_max, y_min, y_max = self.area
        if self.team.placement == "together":
            return (x_min + x_max) / 2, (y_min + y_max) / 2
        recording = self.recording() if self.team.placement == "traffic" else None
        return None if recording is None else traffic_centres(recording, self.n_agents)[k]

    def recording(self) -> Recording | None:
        """The recorded trajectories on the grid of `dt`, or None when targets are simulated."""
        return None if self.targets.data is None else cached_recording(self.targets.data, self.dt)


def _apply_difference(default: Part, difference: Part | None) -> dict[str, Any]:
    """The fields of the default, those of the difference in place of its own."""
    own = {} if difference is None else difference.model_dump(exclude_none=True)
    if ("sigma" in own) != ("noise_cov" in own):  # either replaces both
        own = {"sigma": None, "noise_cov": None} | own
    return default.model_dump() | own
