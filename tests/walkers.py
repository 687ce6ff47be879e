"""A small environment that passes every conformance check."""

from __future__ import annotations

import copy
from typing import Any, ClassVar

import numpy as np
from gymnasium.spaces import Box
from pettingzoo import ParallelEnv

WALKERS = 3
RETIRES = "walker_2"  # leaves before the others, so that there is an early end to get wrong
RETIREMENT = 6  # the frame in which it leaves


class Walkers(ParallelEnv):
    """Three walkers on a line from -1 to 1, moved by their actions and by noise; one of them leaves early."""

    metadata: ClassVar[dict[str, Any]] = {
        "name": "walkers_v0",
        "render_modes": ["human", "rgb_array", "ansi"],
        "render_fps": 10,
    }

    def __init__(self, max_cycles: int = 12, render_mode: str | None = None) -> None:
        self.max_cycles, self.render_mode = max_cycles, render_mode
        self.possible_agents = [f"walker_{k}" for k in range(WALKERS)]
        self.agents: list[str] = []
        self.frame = 0
        self.positions = np.zeros(WALKERS)
        self.rng = np.random.default_rng()
        self._observation_space = Box(-1, 1, (WALKERS + 1,), np.float32)
        self._action_space = Box(-1, 1, (1,), np.float32)
        self.state_space = Box(-1, 1, (WALKERS,), np.float32)

    def observation_space(self, agent: str) -> Box:
        return self._observation_space

    def action_space(self, agent: str) -> Box:
        return self._action_space

    def reset(self, seed: int | None = None, options: dict | None = None) -> tuple[dict, dict]:
        if seed is not None:
            self.rng = np.random.default_rng(seed)
        self.agents = self.possible_agents[:]
        self.frame = 0
        self.positions = self.rng.uniform(-1, 1, WALKERS)
        return self.observe(self.agents), self.compute_infos(self.agents)

    def step(self, actions: dict) -> tuple[dict, dict, dict, dict, dict]:
        live = self.agents
        self.frame += 1
        self.positions = self.positions + self.rng.normal(0, 0.1, WALKERS)
        for agent, action in actions.items():
            self.positions[self.possible_agents.index(agent)] += 0.1 * float(action[0])
        self.positions = np.clip(self.positions, -1, 1)
        over = dict.fromkeys(live, self.frame >= self.max_cycles)
        done = {agent: agent == RETIRES and self.frame == RETIREMENT for agent in live}
        self.agents = [agent for agent in live if not (done[agent] or over[agent])]
        return self.observe(live), self.compute_rewards(live), done, over, self.compute_infos(live)

    def observe(self, agents: list[str]) -> dict[str, np.ndarray]:
        return {a: np.array([k / WALKERS - 1, *self.positions], np.float32) for k, a in enumerate(agents)}

    def compute_rewards(self, agents: list[str]) -> dict[str, float]:
        return {agent: float(self.positions[self.possible_agents.index(agent)]) for agent in agents}

    def compute_infos(self, agents: list[str]) -> dict[str, dict]:
        return {agent: {"frame": self.frame} for agent in agents}

    def state(self) -> np.ndarray:
        return self.positions.astype(np.float32)

    def get_state(self) -> dict[str, Any]:
        kept = {"frame": self.frame, "agents": self.agents, "positions": self.positions}
        return copy.deepcopy({**kept, "rng": self.rng.bit_generator.state})

    def set_state(self, state: dict[str, Any]) -> None:
        kept = copy.deepcopy(state)
        self.frame, self.agents, self.positions = kept["frame"], kept["agents"], kept["positions"]
        if "rng" in kept:
            self.rng.bit_generator.state = kept["rng"]

    def render(self) -> Any:
        if self.render_mode == "rgb_array":
            return np.zeros((4, 4, 3), np.uint8)
        return str(self.positions) if self.render_mode == "ansi" else None

    def close(self) -> None:
        pass
