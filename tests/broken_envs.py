"""A small environment that passes every conformance check, and what becomes of it with one fault each."""

from __future__ import annotations

import copy
from typing import Any, ClassVar

import numpy as np
from gymnasium.spaces import Box
from pettingzoo import ParallelEnv

ARMS = 3
RETIRES = "walker_2"  # leaves before the others, so that there is a death to get wrong
RETIREMENT = 6  # frames


class Walkers(ParallelEnv):
    """Three walkers on a line from -1 to 1: they push, noise pushes back, and one of them retires early."""

    metadata: ClassVar[dict[str, Any]] = {
        "name": "walkers_v0",
        "render_modes": ["human", "rgb_array", "ansi"],
        "render_fps": 10,
    }

    def __init__(self, max_cycles: int = 12, render_mode: str | None = None) -> None:
        self.max_cycles, self.render_mode = max_cycles, render_mode
        self.possible_agents = [f"walker_{k}" for k in range(ARMS)]
        self.agents: list[str] = []
        self.frame = 0
        self.positions = np.zeros(ARMS)
        self.rng = np.random.default_rng()
        self._observation_space = Box(-1, 1, (ARMS + 1,), np.float32)
        self._action_space = Box(-1, 1, (1,), np.float32)
        self.state_space = Box(-1, 1, (ARMS,), np.float32)

    def observation_space(self, agent: str) -> Box:
        return self._observation_space

    def action_space(self, agent: str) -> Box:
        return self._action_space

    def reset(self, seed: int | None = None, options: dict | None = None) -> tuple[dict, dict]:
        if seed is not None:
            self.rng = np.random.default_rng(seed)
        self.agents = self.possible_agents[:]
        self.frame = 0
        self.positions = self.rng.uniform(-1, 1, ARMS)
        return self.observe(self.agents), self.tell(self.agents)

    def step(self, actions: dict) -> tuple[dict, dict, dict, dict, dict]:
        live = self.agents
        self.frame += 1
        self.positions = self.positions + self.rng.normal(0, 0.1, ARMS)
        for agent, action in actions.items():
            self.positions[self.possible_agents.index(agent)] += 0.1 * float(action[0])
        self.positions = np.clip(self.positions, -1, 1)
        over = dict.fromkeys(live, self.frame >= self.max_cycles)
        done = {agent: agent == RETIRES and self.frame == RETIREMENT for agent in live}
        self.agents = [agent for agent in live if not (done[agent] or over[agent])]
        return self.observe(live), self.pay(live), done, over, self.tell(live)

    def observe(self, agents: list[str]) -> dict[str, np.ndarray]:
        return {a: np.array([k / ARMS - 1, *self.positions], np.float32) for k, a in enumerate(agents)}

    def pay(self, agents: list[str]) -> dict[str, float]:
        return {agent: float(self.positions[self.possible_agents.index(agent)]) for agent in agents}

    def tell(self, agents: list[str]) -> dict[str, dict]:
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


# The five that PettingZoo's tests should find, and two of which they let pass.


class SeedDropped(Walkers):
    def reset(self, seed: int | None = None, options: dict | None = None) -> tuple[dict, dict]:
        return super().reset(None, options)


class NondeterministicFromSecondStep(Walkers):
    def step(self, actions: dict) -> tuple[dict, dict, dict, dict, dict]:
        if self.frame >= 1:
            self.positions = self.positions + np.random.default_rng().normal(0, 0.1, ARMS)
        return super().step(actions)


class ObservationOutsideItsSpace(Walkers):
    def observe(self, agents: list[str]) -> dict[str, np.ndarray]:
        scale = np.float32(1.0 if self.frame < 4 else 5.0)
        return {agent: scale * observation for agent, observation in super().observe(agents).items()}


class StateLostOnCopy(Walkers):
    def __deepcopy__(self, memo: dict) -> Walkers:
        twin = _duplicate(self, memo)
        twin.rng = np.random.default_rng(0)
        return twin


class AgentRevived(Walkers):
    def step(self, actions: dict) -> tuple[dict, dict, dict, dict, dict]:
        if self.frame == RETIREMENT + 1:
            self.agents = [*self.agents, RETIRES]
        return super().step(actions)


# One for each of the other checks.


class WithoutAnOptionsArgument(Walkers):
    def reset(self, seed: int | None = None) -> tuple[dict, dict]:  # type: ignore[override]
        return super().reset(seed)


class WordsAsImage(Walkers):
    def render(self) -> Any:
        return "walkers" if self.render_mode == "rgb_array" else super().render()


class StateOutsideItsSpace(Walkers):
    def state(self) -> np.ndarray:
        return super().state() + np.float32(3)


class MaxCyclesOverrun(Walkers):
    def __init__(self, max_cycles: int = 12, render_mode: str | None = None) -> None:
        super().__init__(max_cycles + 1, render_mode)


class MaxCyclesIgnored(Walkers):
    def __init__(self, max_cycles: int = 12, render_mode: str | None = None) -> None:
        super().__init__(200, render_mode)


class SpacesMadeAnew(Walkers):
    def observation_space(self, agent: str) -> Box:
        return copy.deepcopy(self._observation_space)


class ObservationsOverwritten(Walkers):
    def __init__(self, max_cycles: int = 12, render_mode: str | None = None) -> None:
        super().__init__(max_cycles, render_mode)
        self.buffers = {agent: np.zeros(ARMS + 1, np.float32) for agent in self.possible_agents}

    def observe(self, agents: list[str]) -> dict[str, np.ndarray]:
        for agent, observation in super().observe(agents).items():
            self.buffers[agent][:] = observation
        return {agent: self.buffers[agent] for agent in agents}


class RewardsAreArrays(Walkers):
    def pay(self, agents: list[str]) -> dict[str, Any]:
        return {agent: np.float32(reward) for agent, reward in super().pay(agents).items()}


class InfoGainsAKey(Walkers):
    def tell(self, agents: list[str]) -> dict[str, dict]:
        return {agent: {"frame": self.frame, **({"late": 1} if self.frame > 2 else {})} for agent in agents}


class RewardMissing(Walkers):
    def pay(self, agents: list[str]) -> dict[str, float]:
        rewards = super().pay(agents)
        if self.frame == 3:
            del rewards["walker_1"]
        return rewards


class EverySeedTheSame(Walkers):
    def reset(self, seed: int | None = None, options: dict | None = None) -> tuple[dict, dict]:
        return super().reset(None if seed is None else 7, options)


class UnseededResetRepeats(Walkers):
    seed = 0

    def reset(self, seed: int | None = None, options: dict | None = None) -> tuple[dict, dict]:
        self.seed = self.seed if seed is None else seed
        return super().reset(self.seed, options)


class UnseededResetForgets(Walkers):
    def reset(self, seed: int | None = None, options: dict | None = None) -> tuple[dict, dict]:
        if seed is None:
            self.rng = np.random.default_rng()
        return super().reset(seed, options)


class GeneratorSharedByCopies(Walkers):
    def __deepcopy__(self, memo: dict) -> Walkers:
        twin = _duplicate(self, memo)
        twin.rng = self.rng
        return twin


class StateLostInPickle(Walkers):
    def __deepcopy__(self, memo: dict) -> Walkers:
        return _duplicate(self, memo)

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in self.__dict__.items() if key != "rng"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, rng=np.random.default_rng(0))


class SnapshotWithoutTheGenerator(Walkers):
    def get_state(self) -> dict[str, Any]:
        return {key: value for key, value in super().get_state().items() if key != "rng"}


class ClosesOnlyOnce(Walkers):
    is_open = True

    def close(self) -> None:
        if not self.is_open:
            raise RuntimeError("already closed")
        self.is_open = False


class KeepsEveryFrame(Walkers):
    def __init__(self, max_cycles: int = 12, render_mode: str | None = None) -> None:
        super().__init__(max_cycles, render_mode)
        self.history: list[np.ndarray] = []

    def step(self, actions: dict) -> tuple[dict, dict, dict, dict, dict]:
        self.history.append(self.positions.copy())
        return super().step(actions)


def _duplicate(env: Walkers, memo: dict) -> Walkers:
    twin = object.__new__(type(env))
    memo[id(env)] = twin
    twin.__dict__.update({key: copy.deepcopy(value, memo) for key, value in env.__dict__.items()})
    return twin
