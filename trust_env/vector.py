"""The batched face: W worlds, arrays in, arrays out."""

from __future__ import annotations

from _thread import get_ident
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.spaces import Box

from trust_env.batch import Batch, Face, checked_seed
from trust_env.exclusive import THREAD
from trust_env.staging import checked_actions
from trust_env.world.fields import FRAME_METRICS

__all__ = ["VectorEnv", "vector_env"]


class VectorEnv(Face):
    """W worlds of one scenario under one defense, in step.

    num_worlds: W; max_cycles overrides the scenario's horizon (frames); threads: default, the processors this
    process may use; autoreset: finished worlds begin their next episode in the same step, their last
    observations stand in `info["final_obs"]`. The worlds of a seed are the same whatever W, the threads, the
    defense or the actions.
    """

    def __init__(
        self,
        scenario: Any = "patrol",
        defense: Any = "trust",
        num_worlds: int = 1,
        max_cycles: int | None = None,
        threads: int | None = None,
        autoreset: bool = True,
    ):
        self.worlds = Batch(scenario, defense, num_worlds, horizon=max_cycles, threads=threads)
        self.scenario, self.defense, self.num_worlds = self.worlds.scenario, self.worlds.defense, num_worlds
        self.max_cycles, self.autoreset = self.worlds.horizon, autoreset
        self.possible_agents = list(self.scenario.agent_names)
        self.single_observation_space = Box(-1.0, 1.0, (self.observation_table.size,), np.float32)
        self.single_action_space = Box(-1.0, 1.0, (self.action_table.size,), np.float32)
        self._started = False

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode in every world: observations float32[W, K, O] and info.

        Without a seed: the next episode of every world. options: {"worlds": int[W], "episodes": int[W]} picks
        what is replayed.
        """
        with self.worlds.use:
            self._begin_episodes(seed, options or {})
            return self.worlds.arrays.observation.copy(), _info(self.worlds.head())

    def _begin_episodes(self, seed: int | None, options: Mapping[str, Any]) -> None:
        arrays = self.worlds.arrays
        fresh = seed is not None or not self._started
        number = checked_seed(seed) if fresh else arrays.seed.copy()
        worlds = np.arange(self.num_worlds) if fresh else arrays.world_id.copy()
        episodes = np.zeros_like(worlds) if fresh else arrays.episode + 1
        worlds = self._indices("worlds", options["worlds"]) if "worlds" in options else worlds
        episodes = self._indices("episodes", options["episodes"]) if "episodes" in options else episodes
        self.worlds.use.unfinished = True  # only now, when all of it has been checked
        arrays.seed[...], arrays.world_id[...], arrays.episode[...] = number, worlds, episodes
        self.worlds.start(np.ones(self.num_worlds, dtype=bool))
        self._started = True
        self.worlds.use.unfinished = False

    def step(self, actions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """One frame of every world on actions[W, K, A]: observations, rewards float64[W, K], terminated and
        truncated bool[W], info. RuntimeError before the first reset, from a second thread, and after a step or a
        reset that broke off (an interrupt, an error in a user's own defense).
        """
        use, thread = self.worlds.use, get_ident()
        if use.holder.setdefault(THREAD, thread) != thread:
            use.take_over()
        try:
            if use.unfinished or not self._started:
                self._refuse_step()
            result = self._step(checked_actions(actions, self.worlds.arrays.action.shape, self.possible_agents))
            use.unfinished = False
            return result
        finally:
            use.holder.clear()

    def _refuse_step(self) -> None:
        self.worlds.use.check_finished()
        raise RuntimeError("call reset() before step()")

    def _step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        arrays = self.worlds.arrays
        self.worlds.step(actions)
        head = self.worlds.head()
        truncated, info = head["frame"] >= self.max_cycles, _info(head)
        if self.autoreset and truncated.any():
            info["final_obs"] = arrays.observation.copy()
            arrays.episode[truncated] += 1
            self.worlds.start(truncated)
        terminated = np.zeros(self.num_worlds, dtype=bool)
        return arrays.observation.copy(), head["reward"], terminated, truncated, info

    def _indices(self, name: str, values: Any) -> np.ndarray:
        array = np.asarray(values)
        if array.shape != (self.num_worlds,) or array.dtype.kind not in "iu" or array.min() < 0 or array.max() >= 2**32:
            raise ValueError(f"option {name!r} must hold {self.num_worlds} integers from 0 to 2^32 - 1; got {values!r}")
        return array

    def close(self) -> None:
        """Free the worlds; may be called twice."""
        self.worlds.close()


def _info(head: np.ndarray) -> dict[str, Any]:
    return {name: head[name] for name in FRAME_METRICS} | {
        "agent_trust": head["agent_trust"],
        "seed": head["seed"],
        "world": head["world_id"],
        "episode": head["episode"],
        "frame": head["frame"],
    }


def vector_env(
    scenario: Any = "patrol",
    defense: Any = "trust",
    num_worlds: int = 1,
    max_cycles: int | None = None,
    threads: int | None = None,
    autoreset: bool = True,
) -> VectorEnv:
    """W worlds as arrays; see `VectorEnv`."""
    return VectorEnv(scenario, defense, num_worlds, max_cycles, threads, autoreset)
