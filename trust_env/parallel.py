"""The PettingZoo face: one world, dicts in, dicts out."""

from __future__ import annotations

import copy
from _thread import get_ident
from collections.abc import Mapping
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils import wrappers
from pettingzoo.utils.conversions import parallel_to_aec

from trust_env.batch import Batch, Face, checked_seed
from trust_env.errors import unknown_name
from trust_env.exclusive import THREAD
from trust_env.snapshot import check_snapshot
from trust_env.spaces.state import StateTable
from trust_env.staging import StagedActions
from trust_env.world.fields import FRAME_METRICS

INFO_KEYS = tuple(FRAME_METRICS)[:5]


class TrustEnv(Face, ParallelEnv):
    """One world as a PettingZoo parallel environment.

    scenario: a name, `patrol(horizon=50)`, a YAML file, a mapping or a Scenario; defense: a name,
    `trust(preset=cdc2024)`, `my_file.py:MyDefense(window=9)` or an object with `reset` and `update`;
    render_mode: None, "rgb_array", "human" or "ansi"; max_cycles overrides the scenario's horizon (frames).

    Agents act at once; all leave together, by truncation, at the horizon. Actions and observations:
    `trust_env.action`, `observation_table`.
    """

    metadata: ClassVar[dict[str, Any]] = {  # pyright: ignore[reportIncompatibleVariableOverride]
        "name": "trust_env_v0",
        "render_modes": ["human", "rgb_array", "ansi"],
        "render_fps": 10,
        "is_parallelizable": True,
    }

    def __init__(
        self,
        scenario: Any = "patrol",
        defense: Any = "trust",
        render_mode: str | None = None,
        max_cycles: int | None = None,
    ):
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise unknown_name("render mode", render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self.worlds = Batch(scenario, defense, 1, horizon=max_cycles)
        self.scenario, self.max_cycles = self.worlds.scenario, self.worlds.horizon
        self.possible_agents = list(self.scenario.agent_names)
        self.agents: list[str] = []
        size, actions = self.observation_table.size, self.action_table.size
        self._observation_spaces = {a: Box(-1.0, 1.0, (size,), np.float32) for a in self.possible_agents}
        self._action_spaces = {a: Box(-1.0, 1.0, (actions,), np.float32) for a in self.possible_agents}
        self.state_table = self._state_table()
        self.state_space = Box(-1.0, 1.0, (self.state_table.size,), np.float32)
        self._started = False
        self._renderer: Any = None
        self._bind()

    def _bind(self) -> None:
        """Views that a step needs, cut once."""
        arrays = self.worlds.arrays
        self._observation = arrays.observation[0]
        self._reward, self._frame = arrays.reward[0], arrays.frame
        self._metrics = arrays.metrics[0, : len(INFO_KEYS)]
        self._staged = StagedActions(self.possible_agents, self.action_table.size)

    def _state_table(self) -> StateTable:
        parameters, horizon = self.worlds.parameters, self.max_cycles
        return StateTable(parameters.lengths, parameters.observation.scales, self.worlds.roles, horizon)

    def observation_space(self, agent: str) -> Box:
        return self._observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        return self._action_spaces[agent]

    def reset(self, seed: int | None = None, options: Mapping[str, Any] | None = None):
        """Begin an episode: the first of `seed`, or the next one without a seed (the very first draws fresh
        entropy).

        options: {"world": w, "episode": e} replays one evaluated episode; unknown options are ignored.
        """
        with self.worlds.use:
            self._begin_episode(seed, options or {})
            return dict(zip(self.agents, self._observation.copy(), strict=True)), self._infos()

    def _begin_episode(self, seed: int | None, options: Mapping[str, Any]) -> None:
        arrays = self.worlds.arrays
        fresh = seed is not None or not self._started  # then seed and options alone decide what begins
        world = _index(options, "world", 0 if fresh else arrays.world_id[0, ...])
        episode = _index(options, "episode", 0 if fresh else arrays.episode[0, ...] + 1)
        number = checked_seed(seed) if fresh else arrays.seed[0, ...]
        self.worlds.use.unfinished = True
        arrays.seed[...], arrays.episode[...], arrays.world_id[...] = number, episode, world
        self.worlds.start(np.ones(1, dtype=bool))
        self._started, self.agents = True, self.possible_agents[:]
        self.worlds.use.unfinished = False

    def step(self, actions: Mapping[str, Any]):
        """One frame. ValueError names the agent whose action is missing, unknown, of a wrong shape or not
        finite; nothing has changed then. RuntimeError without agents, from a second thread, and after a step or a
        reset that broke off (an interrupt, an error in a user's own defense).
        """
        use, thread = self.worlds.use, get_ident()
        if use.holder.setdefault(THREAD, thread) != thread:
            use.take_over()
        try:
            if use.unfinished or not self.agents:
                self._refuse_step()
            self.worlds.step(self._staged.take(actions))
            result = self._results()
            use.unfinished = False
        finally:
            use.holder.clear()
        if self.render_mode == "human":
            self.render()
        return result

    def _results(self):
        """What `step` returns; at the end of the episode all agents leave."""
        agents, over = self.agents, bool(self._frame[0] >= self.max_cycles)
        observations = dict(zip(agents, self._observation.copy(), strict=True))
        rewards = dict(zip(agents, self._reward.tolist(), strict=True))
        result = observations, rewards, dict.fromkeys(agents, False), dict.fromkeys(agents, over), self._infos()
        if over:
            self.agents = []
        return result

    def _infos(self) -> dict[str, dict[str, float]]:
        values = self._metrics.tolist()
        return {agent: dict(zip(INFO_KEYS, values, strict=True)) for agent in self.agents}

    def _refuse_step(self) -> None:
        self.worlds.use.check_finished()
        if self._started:
            raise RuntimeError("the episode is over (all agents have left): call reset() before step()")
        raise RuntimeError("call reset() before step()")

    def state(self) -> np.ndarray:
        """The whole truth and the whole tracker, float32 in [-1, 1]; fields: `state_table`."""
        with self.worlds.use:
            self.worlds.use.check_finished()
            return self.state_table.read(self.arrays, 0)

    def get_state(self) -> dict[str, Any]:
        """A snapshot from which `set_state` continues bit for bit, here or in another environment of the same
        scenario and defense.
        """
        with self.worlds.use:
            self.worlds.use.check_finished()
            return {
                "row": self.worlds.rows[0].copy(),
                "agents": self.agents[:],
                "started": self._started,
                "defense": copy.deepcopy(self.worlds.own_defense),
            }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on from a snapshot of `get_state`.

        Raises ValueError, and changes nothing, if it is none, or of an environment of another scenario or defense.
        """
        with self.worlds.use:
            check_snapshot(state, self.worlds, self.possible_agents)
            defense = copy.deepcopy(state["defense"])
            self.worlds.use.unfinished = True
            self.worlds.rows[0] = state["row"]
            self.agents, self._started = list(state["agents"]), state["started"]
            if defense is not None:
                self.worlds.own_defense = defense
            self.worlds.use.unfinished = False

    def render(self):
        """A frame: uint8[H, W, 3] (`rgb_array`) or text (`ansi`); None after drawing it in a window
        (`human`).
        """
        if self.render_mode is None:
            gymnasium.logger.warn('render() without a render mode: pass render_mode="rgb_array", "human" or "ansi"')
            return None
        if not self._started:
            raise RuntimeError("call reset() before render()")
        with self.worlds.use:
            self.worlds.use.check_finished()
            if self._renderer is None:
                from trust_env.render import make_renderer

                self._renderer = make_renderer(self.worlds, self.render_mode, self.metadata["render_fps"])
            return self._renderer.draw()

    def close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
        self.worlds.close()

    def __getstate__(self) -> dict[str, Any]:
        bound = ("_observation", "_reward", "_metrics", "_frame", "_staged", "state_table")
        return {name: value for name, value in self.__dict__.items() if name not in bound} | {"_renderer": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.state_table = self._state_table()
        self._bind()

    def __repr__(self) -> str:
        return (
            f"TrustEnv(scenario={self.scenario.name!r}, defense={type(self.worlds.defense).__name__}, "
            f"agents={len(self.possible_agents)})"
        )


def _index(options: Mapping[str, Any], name: str, default: Any) -> Any:
    value = options.get(name, default)
    if name in options and (
        isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not 0 <= value < 2**32
    ):
        raise ValueError(f"option {name!r} must be an integer from 0 to 2^32 - 1; got {value!r}")
    return value


def parallel_env(
    scenario: Any = "patrol",
    defense: Any = "trust",
    render_mode: str | None = None,
    max_cycles: int | None = None,
) -> TrustEnv:
    """The PettingZoo parallel environment; see `TrustEnv`."""
    return TrustEnv(scenario, defense, render_mode, max_cycles)


def raw_env(
    scenario: Any = "patrol",
    defense: Any = "trust",
    render_mode: str | None = None,
    max_cycles: int | None = None,
) -> AECEnv:
    """The same, agent by agent (AEC), bare."""
    return parallel_to_aec(parallel_env(scenario, defense, render_mode, max_cycles))


def env(
    scenario: Any = "patrol",
    defense: Any = "trust",
    render_mode: str | None = None,
    max_cycles: int | None = None,
) -> AECEnv:
    """The same, agent by agent (AEC), with PettingZoo's check of the order of calls."""
    return wrappers.OrderEnforcingWrapper(raw_env(scenario, defense, render_mode, max_cycles))
