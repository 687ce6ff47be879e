"""What a policy is: it sees the observations of its own agents and the scenario, and returns their actions.

One policy object plays all agents that it is given (a coalition), in one world or in a batch. It draws random
numbers only from streams that are a function of (seed, world, episode), so that what happens in a world does
not depend on the batch that it is played in.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np

from trust_env.scenario import Fovs, Scenario
from trust_env.spaces.action import ActionTable
from trust_env.spaces.observation import KNOWLEDGE, ObservationTable
from trust_env.spec import Spec
from trust_env.world.random import POLICY, uniforms

# What random numbers are for. The index of a stream has 24 bits: here 6 of agent, 4 of purpose, 14 of index.
ACTION, PLACE, MOVE, FIRE, CHOOSE, CANDIDATE = range(6)
MOST_DRAWS = 1 << 14

_Rows = np.ndarray | slice
_ALL = slice(None)


@dataclass(frozen=True)
class PolicyContext:
    """Which agents of which worlds a policy plays, and which of them begin an episode now."""

    scenario: Scenario
    observation_table: ObservationTable
    agents: np.ndarray  # int[n], indices in `possible_agents`
    seed: int
    worlds: np.ndarray  # int[W]
    episodes: np.ndarray  # int[W]
    mask: np.ndarray  # bool[W]

    def fits(self, other: PolicyContext) -> bool:
        """Whether only seeds and episodes differ."""
        same = self.scenario is other.scenario and self.observation_table is other.observation_table
        return same and len(self.worlds) == len(other.worlds) and np.array_equal(self.agents, other.agents)


@runtime_checkable
class PolicyLike(Protocol):
    """What an object needs to be played; its `knowledge` (else "own") is the least level that it needs."""

    def reset(self, context: PolicyContext) -> None: ...

    def act(self, observations: np.ndarray) -> np.ndarray: ...


class Policy:
    """A policy in which only `choose` is left to write.

    knowledge: the least knowledge level that it needs. After `reset` there are `context`, `frame` int[W]
    (frames since the episode began), `dt` (s), and of its own agents `fovs` and the budgets `injections` and
    `suppressions` int[n].
    """

    name: ClassVar[str] = "policy"
    knowledge: str = "own"

    _context: PolicyContext | None = None
    frame: np.ndarray
    fovs: Fovs
    injections: np.ndarray
    suppressions: np.ndarray
    dt: float

    @property
    def context(self) -> PolicyContext:
        if self._context is None:
            raise RuntimeError(f"{self.name}: call reset(context) before act(observations)")
        return self._context

    def reset(self, context: PolicyContext) -> None:
        """Begin an episode in the worlds of `context.mask`; the others go on."""
        goes_on = self._context is not None and self._context.fits(context)
        self._context = context
        if not goes_on:
            agents = [context.scenario.agent(int(k)) for k in context.agents]
            self.fovs, self.dt = Fovs.of(context.scenario, context.agents), context.scenario.dt
            self.injections = np.array([agent.budget.injections for agent in agents], dtype=np.int64)
            self.suppressions = np.array([agent.budget.suppressions for agent in agents], dtype=np.int64)
            self.frame = np.zeros(len(context.worlds), dtype=np.int64)
            self.prepare(context)
        self.frame[context.mask] = 0

    def prepare(self, context: PolicyContext) -> None:
        """Hook: check against the scenario, allocate; called when the scenario or a batch's shape is new."""

    def act(self, observations: np.ndarray) -> np.ndarray:
        """Actions float32[W, n, A] on observations[W, n, O] of the own agents; one call per frame."""
        actions = self.choose(self.context.observation_table.read(observations, self.context.agents))
        self.frame += 1
        return actions

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """Actions float32[W, n, A] on the fields of the observation table, in metres, each [W, n, ...]."""
        raise NotImplementedError(
            f"{type(self).__name__} needs a method choose(self, seen), or act(self, observations)"
        )

    def draw(
        self, purpose: int, count: int, rows: _Rows = _ALL, agents: np.ndarray | None = None
    ) -> np.ndarray:
        """U[0, 1) draws [W, n, count] for the present frame of every world (or of some rows) and agent."""
        if count > MOST_DRAWS:
            raise ValueError(
                f"{self.name}: draws {count} numbers per agent and frame; at most {MOST_DRAWS} are possible"
            )
        c, frame = self.context, self.frame[rows]
        worlds, episodes = c.worlds[rows], c.episodes[rows]
        owners = c.agents if agents is None else agents
        out = np.empty((len(frame), len(owners), count))
        for i, k in enumerate(owners):
            first = (int(k) << 18) | (purpose << 14)
            out[:, i] = uniforms(c.seed, worlds, episodes, POLICY, frame, count, first)
        return out

    def nothing(self) -> np.ndarray:
        """The honest action float32[W, n, A]: zeros."""
        return ActionTable(self.context.scenario).nothing(len(self.frame), len(self.context.agents))

    def encode(
        self,
        pose: np.ndarray,
        positions: np.ndarray | None = None,
        fire: np.ndarray | None = None,
        suppress: np.ndarray | None = None,
    ) -> np.ndarray:
        """Actions from metres, in budget: positions[W, n, P, 2] where fire[W, n, P], suppress[W, n, D]."""
        if positions is not None and positions.shape[-2] == 0:
            positions = None
        if positions is not None:
            allowed = np.arange(positions.shape[-2]) < self.injections[:, None]
            fire = np.broadcast_to(allowed if fire is None else fire & allowed, positions.shape[:-1])
        if suppress is not None:
            suppress = suppress & (np.arange(suppress.shape[-1]) < self.suppressions[:, None])
        return ActionTable(self.context.scenario).encode(self.fovs.boxes(pose), positions, fire, suppress)

    def __repr__(self) -> str:
        known = [name for name in inspect.signature(type(self)).parameters if hasattr(self, name)]
        return str(Spec(self.name, {name: _plain(getattr(self, name)) for name in known}))


def _plain(value: Any) -> Any:
    return repr(value) if isinstance(value, Policy) else value


def check_knowledge(policy: Any, scenario: Scenario) -> None:
    """ValueError, naming both levels, if the scenario lets agents observe less than the policy needs."""
    needed = knowledge_of(policy)
    if KNOWLEDGE[scenario.knowledge] < KNOWLEDGE[needed]:
        raise ValueError(
            f"policy {name_of(policy)!r} needs knowledge level {needed!r}, but scenario {scenario.name!r} "
            f"gives {scenario.knowledge!r}; give more with '{scenario.name}(knowledge={needed})'"
        )


def sufficient_knowledge(scenario: Scenario, *policies: Any) -> str:
    """The least knowledge level, from the scenario's own on, at which all the policies can play."""
    levels = [scenario.knowledge, *(knowledge_of(policy) for policy in policies)]
    return max(levels, key=KNOWLEDGE.__getitem__)


def knowledge_of(policy: Any) -> str:
    """The least knowledge level that a policy needs."""
    level = getattr(policy, "knowledge", "own")
    if level not in KNOWLEDGE:
        raise ValueError(
            f"policy {name_of(policy)!r}: knowledge = {level!r}: expected one of {', '.join(KNOWLEDGE)}"
        )
    return level


def name_of(policy: Any) -> str:
    return getattr(policy, "name", None) or type(policy).__name__
