"""Learners as a Stable-Baselines3 `VecEnv`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices

from trust_env.batch import checked_seed
from trust_env.training.learning.learners import Learners


class LearnersVecEnv(VecEnv):
    """One environment per learner. Episodes end by truncation: with `TimeLimit.truncated` and
    `terminal_observation`, so that values are bootstrapped at the horizon, and with `episode`
    ({"r": return, "l": length}), as `VecMonitor` reports it.

    learners: a `Learners`, or what makes one: `LearnersVecEnv("patrol", "trust", num_worlds=128)`.
    """

    def __init__(self, learners: Any = "patrol", *args: Any, **kwargs: Any):
        self.learners = learners if isinstance(learners, Learners) else Learners(learners, *args, **kwargs)
        own = self.learners
        self._returns, self._lengths = np.zeros(own.num_learners), np.zeros(own.num_learners, dtype=np.int64)
        self.metrics: dict[str, np.ndarray] = {}  # of the last frame, by name, [W] each
        super().__init__(own.num_learners, own.observation_space, own.action_space)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """The seed of the next `reset`; one seed is that of all worlds, which differ all the same."""
        self._seeds = [checked_seed(seed)] * self.num_envs
        return self._seeds

    def reset(self) -> np.ndarray:
        self._returns[:], self._lengths[:] = 0.0, 0
        observations = self.learners.reset(self._seeds[0])
        self.reset_infos = [{} for _ in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        self._choices = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        observations, rewards, truncated, info = self.learners.step(self._choices)
        self.metrics = info["metrics"]
        self._returns += rewards
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        if "final_obs" in info:
            self._report(np.flatnonzero(truncated), info["final_obs"], infos)
        return observations, rewards, truncated, infos

    def _report(self, ended: np.ndarray, final: np.ndarray, infos: list[dict[str, Any]]) -> None:
        for i in ended.tolist():
            infos[i] = {
                "episode": {"r": float(self._returns[i]), "l": int(self._lengths[i])},
                "terminal_observation": final[i],
                "TimeLimit.truncated": True,
            }
        self._returns[ended], self._lengths[ended] = 0.0, 0

    def get_state(self) -> dict[str, Any]:
        """A snapshot of NumPy arrays and built-in values; see `Learners.get_state`."""
        own = {"returns": self._returns.copy(), "lengths": self._lengths.copy()}
        return self.learners.get_state() | own

    def set_state(self, state: Mapping[str, Any]) -> None:
        self.learners.set_state(state)
        self._returns[:], self._lengths[:] = state["returns"], state["lengths"]

    def observe(self) -> np.ndarray:
        """What the learners see at present, float32[I, O']."""
        return self.learners.observe()

    def close(self) -> None:
        self.learners.close()

    # --- what SB3 asks of separate environments ---

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        value = None if attr_name == "render_mode" else getattr(self.learners, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        raise AttributeError(f"{attr_name}: learners share their worlds; none has attributes of its own")

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        raise AttributeError(f"{method_name}: learners share their worlds; none has methods of its own")

    def env_is_wrapped(self, wrapper_class: type[Any], indices: VecEnvIndices = None) -> list[bool]:
        return [False for _ in self._get_indices(indices)]
