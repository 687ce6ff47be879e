"""The walkers with one fault each, named by the fault."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from walkers import RETIREMENT, RETIRES, WALKERS, Walkers


class SeedDropped(Walkers):
    def reset(self, seed: int | None = None, options: dict | None = None) -> tuple[dict, dict]:
        return super().reset(None, options)


class NondeterministicFromSecondStep(Walkers):
    def step(self, actions: dict) -> tuple[dict, dict, dict, dict, dict]:
        if self.frame >= 1:
            self.positions = self.positions + np.random.default_rng().normal(0, 0.1, WALKERS)
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


class WithoutAnOptionsArgument(Walkers):
    def reset(self, seed: int | None = None) -> tuple[dict, dict]:  # type: ignore[override]
        return super().reset(seed)


class TextAsImage(Walkers):
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


class NewSpacesEachCall(Walkers):
    def observation_space(self, agent: str) -> Box:
        return copy.deepcopy(self._observation_space)


class ObservationsOverwritten(Walkers):
    def __init__(self, max_cycles: int = 12, render_mode: str | None = None) -> None:
        super().__init__(max_cycles, render_mode)
        self.buffers = {agent: np.zeros(WALKERS + 1, np.float32) for agent in self.possible_agents}

    def observe(self, agents: list[str]) -> dict[str, np.ndarray]:
        for agent, observation in super().observe(agents).items():
            self.buffers[agent][:] = observation
        return {agent: self.buffers[agent] for agent in agents}


class RewardsAreArrays(Walkers):
    def compute_rewards(self, agents: list[str]) -> dict[str, Any]:
        return {agent: np.float32(reward) for agent, reward in super().compute_rewards(agents).items()}


class InfoGainsAKey(Walkers):
    def compute_infos(self, agents: list[str]) -> dict[str, dict]:
        return {agent: {"frame": self.frame, **({"late": 1} if self.frame > 2 else {})} for agent in agents}


class RewardMissing(Walkers):
    def compute_rewards(self, agents: list[str]) -> dict[str, float]:
        rewards = super().compute_rewards(agents)
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
