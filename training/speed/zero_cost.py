"""An environment that costs nothing: what is left of a training step is the algorithm's."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.spaces import Space
from stable_baselines3.common.vec_env import VecEnv


class ZeroCost(VecEnv):
    """Returns the same observations and rewards again and again; no episode ends."""

    def __init__(self, num_envs: int, observation_space: Space, action_space: Space):
        super().__init__(num_envs, observation_space, action_space)
        rng, shape = np.random.default_rng(0), observation_space.shape or ()
        self._observations = rng.uniform(-1.0, 1.0, (num_envs, *shape)).astype(np.float32)
        self._rewards = rng.normal(size=num_envs).astype(np.float32)
        self._dones = np.zeros(num_envs, dtype=bool)
        self._infos: list[dict[str, Any]] = [{} for _ in range(num_envs)]

    def reset(self) -> np.ndarray:
        return self._observations

    def step_async(self, actions: np.ndarray) -> None:
        pass

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        return self._observations, self._rewards, self._dones, self._infos

    def close(self) -> None:
        pass

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [None] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise AttributeError(attr_name)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        raise AttributeError(method_name)

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Any = None) -> list[bool]:
        return [False] * self.num_envs
