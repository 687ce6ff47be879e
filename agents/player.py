"""A player plays all agents of an environment with policies, in one world or in a batch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, overload

import numpy as np

from trust_env.agents.base import PolicyContext, PolicyLike
from trust_env.agents.copied_worlds import CopiedWorlds
from trust_env.agents.knowledge import check_knowledge, name_of
from trust_env.agents.registry import build_policy
from trust_env.errors import unknown_name
from trust_env.scenario import Scenario
from trust_env.spaces.action import ActionTable
from trust_env.spaces.observation import ObservationTable
from trust_env.user_code import call, source_of

ROLES = ("adversary", "benign")


class Player:
    """Actions for all agents of a `parallel_env` or a `vector_env`, from a policy by role or by agent.

        player = Player(env, {"adversary": "false_positive(n=2)"})
        observations, infos = env.reset(seed=1)
        while env.agents:
            observations, rewards, terminated, truncated, infos = env.step(player.actions(observations))

    policies: by role ("adversary", "benign") or by agent's name, which takes precedence; all others are
    honest. Agents under one entry, or under one and the same object, form a coalition. The environment says
    which worlds begin an episode, so there is nothing to reset here.
    """

    def __init__(self, env: Any, policies: Mapping[str, Any] | None = None):
        self._env = getattr(env, "unwrapped", env)
        if not all(hasattr(self._env, name) for name in ("scenario", "observation_table", "arrays")):
            raise TypeError(f"a player plays a parallel_env or a vector_env of trust_env; got {env!r}")
        self.scenario: Scenario = self._env.scenario
        self.table: ObservationTable = self._env.observation_table
        self.names = list(self.scenario.agent_names)
        self.coalitions = _coalitions(self.scenario, policies or {})
        for policy, _ in self.coalitions:
            check_knowledge(policy, self.scenario)
        self._action_size = ActionTable(self.scenario).size
        self._copies = CopiedWorlds(self._env.worlds) if self.scenario.knowledge == "white_box" else None
        self._began = False

    @overload
    def actions(self, observations: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]: ...
    @overload
    def actions(self, observations: np.ndarray) -> np.ndarray: ...
    def actions(self, observations: Mapping[str, np.ndarray] | np.ndarray) -> Any:
        """Actions of all agents on their observations: a dict on a dict, float32[W, K, A] on [W, K, O]."""
        if not isinstance(observations, Mapping):
            return self._act(np.asarray(observations))
        stacked = np.stack([observations[name] for name in self.names])
        return dict(zip(self.names, self._act(stacked[None])[0], strict=True))

    def _act(self, observations: np.ndarray) -> np.ndarray:
        begins = self._env.arrays.frame.reshape(-1) == 0
        if not self._began or begins.any():
            self._reset(begins if self._began else np.ones_like(begins))
        actions = np.zeros((*observations.shape[:2], self._action_size), dtype=np.float32)
        for policy, agents in self.coalitions:
            expected = (len(observations), len(agents), self._action_size)
            actions[:, agents] = _checked(policy, call(policy, "act", observations[:, agents]), expected)
        return actions

    def _reset(self, begins: np.ndarray) -> None:
        arrays = self._env.arrays
        seed, worlds = int(arrays.seed.flat[0]), arrays.world_id.reshape(-1).copy()
        episodes = arrays.episode.reshape(-1).copy()
        for policy, agents in self.coalitions:
            context = PolicyContext(self.scenario, self.table, agents, seed, worlds, episodes, begins, self._copies)
            call(policy, "reset", context)
        self._began = True


def _checked(policy: PolicyLike, actions: Any, expected: tuple[int, ...]) -> np.ndarray:
    """A policy's actions[W, n, A] as an array; ValueError, naming the policy, if they are not finite numbers."""

    def invalid(fault: str) -> ValueError:
        return ValueError(f"{source_of(policy)}: policy {name_of(policy)!r} returned {fault}")

    try:
        chosen = np.asarray(actions)
    except Exception as error:
        raise invalid(f"no array of actions: {error}") from error
    if chosen.shape != expected:
        shapes = f"{list(chosen.shape)}; expected {list(expected)} (worlds, agents, entries)"
        raise invalid(f"actions of shape {shapes}")
    if chosen.dtype.kind not in "fiub":
        raise invalid(f"actions of {chosen.dtype}; expected finite numbers")
    if not np.isfinite(chosen).all():
        w, agent, entry = np.argwhere(~np.isfinite(chosen))[0]
        place = f"world {w}, its agent {agent}, entry {entry}"
        raise invalid(f"actions that are not finite: {chosen[w, agent, entry]} ({place})")
    return chosen


def _coalitions(scenario: Scenario, policies: Mapping[str, Any]) -> list[tuple[PolicyLike, np.ndarray]]:
    """Policies and the indices of the agents that each plays."""
    names, roles = scenario.agent_names, scenario.roles
    for key in policies:
        if key not in ROLES and key not in names:
            raise unknown_name("role or agent", key, [*ROLES, *names])
    keys = [next((key for key in pair if key in policies), None) for pair in zip(names, roles)]
    built = {key: build_policy("honest" if key is None else policies[key]) for key in dict.fromkeys(keys)}
    members: dict[int, tuple[PolicyLike, list[int]]] = {}
    for k, key in enumerate(keys):
        members.setdefault(id(built[key]), (built[key], []))[1].append(k)
    return [(policy, np.array(agents)) for policy, agents in members.values()]
