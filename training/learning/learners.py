"""Every agent of a role, in each of many worlds, as one learner: arrays in, arrays out.

`sb3.py` and `gym.py` adapt this to Stable-Baselines3 and Gymnasium.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Space

from trust_env.agents import Player, PolicyContext
from trust_env.agents.player import ROLES
from trust_env.agents.wrappers import DEFAULT_WRAPPER, build_wrapper
from trust_env.errors import unknown_name
from trust_env.scenario import Scenario, load_scenario
from trust_env.training.learning.snapshot_pickle import dump, load
from trust_env.vector import VectorEnv
from trust_env.world.fields import FRAME_METRICS


class Learners:
    """The learners of a `VectorEnv`, I = W n of them: index i = w n + a, for learner a of world w.

    scenario, defense, num_worlds, max_cycles, threads: as of `VectorEnv`; knowledge: another level than the
    scenario's; wrapper: what their actions mean (`agents.wrappers`); learner_role: the role whose agents all
    learn, or the name of the only agent that does; others: policies of the other agents by role or name,
    honest where none is given; stagger: the worlds' first episodes end at different frames, so that later
    ones do not all end at once.

    An episode ends by truncation, at the horizon, and (with `autoreset`) its world begins the next one in the
    same step.
    """

    def __init__(
        self,
        scenario: Any = "patrol",
        defense: Any = "trust",
        num_worlds: int = 1,
        wrapper: Any = DEFAULT_WRAPPER,
        others: Mapping[str, Any] | None = None,
        knowledge: str | None = None,
        max_cycles: int | None = None,
        threads: int | None = None,
        learner_role: str = "adversary",
        stagger: bool = False,
        autoreset: bool = True,
    ):
        own = {} if knowledge is None else {"knowledge": knowledge}
        self.env = VectorEnv(load_scenario(scenario, **own), defense, num_worlds, max_cycles, threads, autoreset=False)
        self.scenario, self.num_worlds = self.env.scenario, num_worlds
        self.agents = _indices(self.scenario, learner_role)
        self.learner_role, self.stagger, self.autoreset = learner_role, stagger, autoreset
        self.wrapper = build_wrapper(wrapper)
        self.num_learners = num_worlds * len(self.agents)
        self._actions = np.zeros((num_worlds, *self.env.worlds.arrays.action.shape[1:]), dtype=np.float32)
        self._player = Player(self.env, others) if others else None
        self._rows = _as_slice(self.agents)
        self._started = False
        self._ends = np.full(num_worlds, self.env.max_cycles)
        self.wrapper.reset(self._context(np.ones(num_worlds, dtype=bool)))
        self.observation_space = Box(-1.0, 1.0, (self.wrapper.observation_size,), np.float32)
        self.action_space: Space = self.wrapper.action_space

    def reset(self, seed: int | None = None) -> np.ndarray:
        """Begin an episode in every world, the first of `seed` or the next: what is seen, float32[I, O']."""
        self.env.reset(seed)
        self._ends[...] = self.env.max_cycles
        if self.stagger:
            fractions = np.arange(1, self.num_worlds + 1) / self.num_worlds
            self._ends[...] = np.ceil(fractions * self.env.max_cycles)
        self._started = True
        self.wrapper.reset(self._context(np.ones(self.num_worlds, dtype=bool)))
        return self.observe()

    def step(self, choices: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Observations float32[I, O'], rewards float32[I], truncated bool[I] and info after choices[I, ...].

        info: "metrics", the environment's by name, [W] each, of this frame; where an episode ended also
        "final_obs" float32[I, O'], what was seen at its end (with `autoreset`).
        """
        arrays = self.env.arrays
        _, rewards, _, _, metrics = self.env.step(self._raw_actions(choices))
        ended = arrays.frame.reshape(-1) >= self._ends
        info: dict[str, Any] = {"metrics": {name: metrics[name] for name in FRAME_METRICS}}
        if self.autoreset and ended.any():
            info["final_obs"] = self.observe()
            self._begin(ended)
        truncated = np.repeat(ended, len(self.agents))
        return self.observe(), rewards[:, self._rows].astype(np.float32).reshape(-1), truncated, info

    def _raw_actions(self, choices: np.ndarray) -> np.ndarray:
        if not self._started:
            raise RuntimeError("call reset() before step()")
        observations = self.env.arrays.observation
        if not self.autoreset and (self.env.arrays.frame.reshape(-1) >= self._ends).all():
            raise RuntimeError("the episodes are over: call reset() before step()")
        if self._player is not None:
            self._actions = self._player.actions(observations)
        choices = np.asarray(choices)
        expected = (self.num_learners, *(self.action_space.shape or ()))
        if choices.shape != expected:
            raise ValueError(f"choices must have shape {list(expected)}; got {list(choices.shape)}")
        if not np.isfinite(choices).all():
            unfit = int(np.argwhere(~np.isfinite(choices))[0][0])
            raise ValueError(f"choices must be finite; those of learner {unfit} are not")
        choices = choices.reshape(self.num_worlds, len(self.agents), *expected[1:])
        self._actions[:, self._rows] = self.wrapper.act(choices, observations[:, self._rows])
        return self._actions

    def observe(self) -> np.ndarray:
        """What the learners see at present, float32[I, O']."""
        seen = self.wrapper.observe(self.env.arrays.observation[:, self._rows])
        return seen.reshape(self.num_learners, -1)

    def _begin(self, worlds: np.ndarray) -> None:
        """The next episode in the worlds of bool[W]."""
        with self.env.worlds.use:
            self.env.worlds.use.unfinished = True
            self.env.arrays.episode[worlds] += 1
            self.env.worlds.start(worlds)
            self.env.worlds.use.unfinished = False
        self._ends[worlds] = self.env.max_cycles
        self.wrapper.reset(self._context(worlds))

    def _context(self, begins: np.ndarray) -> PolicyContext:
        arrays = self.env.arrays
        worlds, episodes = arrays.world_id.reshape(-1).copy(), arrays.episode.reshape(-1).copy()
        seed, table = int(arrays.seed.flat[0]), self.env.observation_table
        return PolicyContext(self.scenario, table, self.agents, seed, worlds, episodes, begins)

    def get_state(self) -> dict[str, Any]:
        """A snapshot of NumPy arrays and built-in values, from which `set_state` continues bit for bit.

        Other learners that were constructed in the same way can take it too.
        """
        return {
            "rows": self.env.worlds.rows.copy(),
            "ends": self._ends.copy(),
            "started": self._started,
            "wrapper": self.wrapper.get_state(),
            "objects": self._dump(),
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Continue from a snapshot. ValueError if it comes from learners constructed in another way."""
        rows, own = np.asarray(state["rows"]), self.env.worlds.rows
        if rows.shape != own.shape or rows.dtype != own.dtype:
            raise ValueError(f"the snapshot holds worlds of {list(rows.shape)} bytes; these need {list(own.shape)}")
        with self.env.worlds.use:
            own[...] = rows
            self.env.worlds.use.unfinished = False
        self._ends[...] = state["ends"]
        self._started = bool(state["started"])
        self.env._started = self._started
        self.wrapper.reset(self._context(np.ones(self.num_worlds, dtype=bool)))
        self.wrapper.set_state(state["wrapper"])
        self._load(state["objects"])

    def _dump(self) -> bytes | None:
        """Objects with a memory of their own, pickled: a user's own defense, the policies of the others."""
        defense, player = self.env.worlds.own_defense, self._player
        if defense is None and player is None:
            return None
        return dump((defense, player and (player.coalitions, player._began)), self._shared())

    def _load(self, objects: bytes | None) -> None:
        if objects is None:
            return
        defense, played = load(objects, self._shared())
        if defense is not None:
            self.env.worlds.own_defense = defense
        if self._player is not None and played is not None:
            self._player.coalitions, self._player._began = played

    def _shared(self) -> list[Any]:
        return [self.scenario, self.env.observation_table]

    def close(self) -> None:
        self.env.close()


def _indices(scenario: Scenario, learner_role: str) -> np.ndarray:
    """Indices of the agents that learn, int[n]."""
    names, roles = scenario.agent_names, scenario.roles
    if learner_role not in ROLES and learner_role not in names:
        raise unknown_name("role or agent", learner_role, [*ROLES, *names])
    found = [k for k in range(len(names)) if learner_role in (names[k], roles[k])]
    if not found:
        raise ValueError(f"scenario {scenario.name!r} has no agent of role {learner_role!r} that could learn")
    return np.array(found)


def _as_slice(indices: np.ndarray) -> slice | np.ndarray:
    """Consecutive indices as a slice, which indexes without a copy; others as they are."""
    first, last = int(indices[0]), int(indices[-1])
    return slice(first, last + 1) if last - first + 1 == len(indices) else indices
