"""What a policy is: actions of its own agents from their observations and the scenario.

One policy object plays all agents that it is given (a coalition), in one world or in a batch. It draws random
numbers only from streams that are a function of (seed, world, episode), so that what happens in a world does
not depend on the batch that it is played in.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np

from trust_env.agents.copied_worlds import CopiedWorlds
from trust_env.agents.search_ranges import SearchRanges
from trust_env.scenario import Fovs, Scenario
from trust_env.spaces.action import ActionTable
from trust_env.spaces.observation import ObservationTable
from trust_env.spec import Spec
from trust_env.world.random import POLICY, uniform_sets

# What random numbers are for. The index of a stream has 24 bits: here 6 of agent, 4 of purpose, 14 of index.
ACTION, PLACE, MOVE, FIRE, CHOOSE, CANDIDATE, NOISE = range(7)
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
    copies: CopiedWorlds | None = None  # to try actions in; only at the knowledge level white_box, and from a `Player`

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
    """A policy in which only `choose` is left to write. After `reset` it knows its context and its agents."""

    name: ClassVar[str] = "policy"
    knowledge: str = "own"  # the least knowledge level that it needs
    scripted: ClassVar[bool] = True  # False: it plays what was trained
    policy_parameters: ClassVar[tuple[str, ...]] = ()  # those that are policies; the registry builds them
    reads: ClassVar[tuple[str, ...] | None] = None  # fields of observations that `choose` wants; None: all
    unsearched: ClassVar[tuple[str, ...]] = ()  # those that a search leaves as they are

    _context: PolicyContext | None = None
    frame: np.ndarray  # int[W], frames since the episode began
    dt: float  # s
    fovs: Fovs  # of its own agents
    injections: np.ndarray  # int[n], their budgets
    suppressions: np.ndarray  # int[n]

    @property
    def context(self) -> PolicyContext:
        """Which agents of which worlds it plays. RuntimeError before `reset`."""
        if self._context is None:
            raise RuntimeError(f"{self.name}: call reset(context) before act(observations)")
        return self._context

    def reset(self, context: PolicyContext) -> None:
        """Begin an episode in the worlds of `context.mask`; the others continue theirs."""
        is_prepared = self._context is not None and self._context.fits(context)
        self._context = context
        if not is_prepared:
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
        seen = self.context.observation_table.read(observations, self.context.agents, self.reads)
        actions = self.choose(seen)
        self.frame += 1
        return actions

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """Actions float32[W, n, A] on the fields of the observation table, in metres, each [W, n, ...]."""
        missing = "a method choose(self, seen), or act(self, observations)"
        raise NotImplementedError(f"{type(self).__name__} needs {missing}")

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        """Hook: what a search for the worst attack may try, by parameter; empty: nothing to search. given: the
        parameters that are not searched, as they are given.
        """
        return {}

    def draw(self, purpose: int, count: int, rows: _Rows = _ALL, agents: np.ndarray | None = None) -> np.ndarray:
        """U[0, 1) draws [W, n, count] for the present frame of every world (or of some rows) and agent."""
        if count > MOST_DRAWS:
            most = f"at most {MOST_DRAWS} are possible"
            raise ValueError(f"{self.name}: draws {count} numbers per agent and frame; {most}")
        c, frame = self.context, self.frame[rows]
        worlds, episodes = c.worlds[rows], c.episodes[rows]
        agents = c.agents if agents is None else agents
        firsts = [(int(k) << 18) | (purpose << 14) for k in agents]
        return uniform_sets(c.seed, worlds, episodes, POLICY, frame, count, firsts).swapaxes(0, 1)

    def zero_actions(self) -> np.ndarray:
        """The honest action float32[W, n, A]: zeros."""
        return ActionTable(self.context.scenario).zero_actions(len(self.frame), len(self.context.agents))

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
        return str(Spec(self.name, {name: _to_builtin(getattr(self, name)) for name in known}))


def _to_builtin(value: Any) -> Any:
    """The value of a parameter as it is written: a policy as its spec."""
    return repr(value) if isinstance(value, Policy) else value
