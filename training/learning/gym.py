"""Learners as a Gymnasium `VectorEnv`, and a single learner as a Gymnasium `Env`."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from trust_env.agents.wrappers import DEFAULT_WRAPPER
from trust_env.batch import Arrays, checked_seed
from trust_env.errors import unknown_name
from trust_env.parallel import TrustEnv
from trust_env.training.learning.learners import Learners
from trust_env.world.fields import FRAME_METRICS

# `gymnasium.make("trust_env.training.learning.gym:TrustEnv/Adversary-v0", scenario="trio")`
gymnasium.register("TrustEnv/Adversary-v0", entry_point="trust_env.training.learning.gym:AdversaryEnv")


class GymVectorEnv(gymnasium.vector.VectorEnv):
    """One sub-environment per learner, which begins its next episode in the step that ends one (SAME_STEP):
    `infos["final_obs"]` then holds what was seen at the end, and `infos["final_info"]["episode"]` the
    return "r", the length "l" and the seconds "t".

    learners: a `Learners`, or what makes one: `GymVectorEnv("patrol", "trust", num_worlds=128)`.
    """

    metadata: ClassVar[dict[str, Any]] = {  # pyright: ignore[reportIncompatibleVariableOverride]
        "name": TrustEnv.metadata["name"],
        "render_modes": [],
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    def __init__(self, learners: Any = "patrol", *args: Any, **kwargs: Any):
        self.learners = learners if isinstance(learners, Learners) else Learners(learners, *args, **kwargs)
        if not self.learners.autoreset:
            raise ValueError("learners of a vector environment reset themselves: expected autoreset=True")
        self.num_envs = self.learners.num_learners
        self.single_observation_space = self.learners.observation_space
        self.single_action_space = self.learners.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._begin(np.ones(self.num_envs, dtype=bool))

    def _begin(self, mask: np.ndarray) -> None:
        if mask.all():
            self._returns, self._lengths = np.zeros(self.num_envs), np.zeros(self.num_envs, dtype=np.int64)
            self._began = np.zeros(self.num_envs)
        self._returns[mask], self._lengths[mask], self._began[mask] = 0.0, 0, time.perf_counter()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode in every world, the first of `seed` or the next; unknown options are ignored."""
        if options and "reset_mask" in options:
            raise ValueError("option 'reset_mask': learners share worlds, so that none can be reset alone")
        super().reset(seed=seed)
        self._begin(np.ones(self.num_envs, dtype=bool))
        return self.learners.reset(seed), {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        observations, rewards, truncated, info = self.learners.step(actions)
        self._returns += rewards
        self._lengths += 1
        infos: dict[str, Any] = {}
        if "final_obs" in info:
            infos = self._final(truncated, info["final_obs"])
            self._begin(truncated)
        terminated = np.zeros(self.num_envs, dtype=bool)
        return observations, rewards.astype(np.float64), terminated, truncated, infos

    def _final(self, ended: np.ndarray, final: np.ndarray) -> dict[str, Any]:
        """In the layout of `VectorEnv._add_info`: every entry with a mask of the learners that it is of."""
        observations = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(ended):
            observations[i] = final[i]
        values = {"r": self._returns, "l": self._lengths, "t": time.perf_counter() - self._began}
        episode = {name: np.where(ended, array, 0) for name, array in values.items()}
        episode |= {f"_{name}": ended.copy() for name in values}
        return {
            "final_obs": observations,
            "_final_obs": ended.copy(),
            "final_info": {"episode": episode, "_episode": ended.copy()},
            "_final_info": ended.copy(),
        }

    def close_extras(self, **kwargs: Any) -> None:
        self.learners.close()


class AdversaryEnv(gymnasium.Env):
    """One agent as the learner of one world; the other agents follow given policies.

    scenario, defense, wrapper, others, knowledge, max_cycles: as of `Learners`; agent: its name, or None for
    the only adversary; render_mode: as of `trust_env.parallel_env`. Episodes end by truncation.
    """

    metadata: ClassVar[dict[str, Any]] = {  # pyright: ignore[reportIncompatibleVariableOverride]
        name: TrustEnv.metadata[name] for name in ("name", "render_modes", "render_fps")
    }

    def __init__(
        self,
        scenario: Any = "trio",
        defense: Any = "trust",
        agent: str | None = None,
        wrapper: Any = DEFAULT_WRAPPER,
        others: Mapping[str, Any] | None = None,
        knowledge: str | None = None,
        max_cycles: int | None = None,
        render_mode: str | None = None,
    ):
        self.learners = Learners(
            scenario,
            defense,
            1,
            wrapper,
            others,
            knowledge,
            max_cycles,
            learner_role="adversary" if agent is None else agent,
            autoreset=False,
        )
        if self.learners.num_learners > 1:
            names = [self.learners.env.possible_agents[k] for k in self.learners.agents]
            raise ValueError(f"agent = {agent!r}: expected one of {', '.join(names)}, as several would learn")
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise unknown_name("render mode", render_mode, self.metadata["render_modes"])
        self.render_mode, self._renderer = render_mode, None
        self.observation_space = self.learners.observation_space
        self.action_space = self.learners.action_space

    @property
    def arrays(self) -> Arrays:
        """Live views of everything in the world, with a leading axis of length 1."""
        return self.learners.env.arrays

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode: the first of `seed`, or the next one; options are ignored."""
        super().reset(seed=seed)
        observations = self.learners.reset(None if seed is None else checked_seed(seed))
        return observations[0], self._info()

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        observations, rewards, truncated, _ = self.learners.step(np.asarray(action)[None])
        if self.render_mode == "human":
            self.render()
        return observations[0], float(rewards[0]), False, bool(truncated[0]), self._info()

    def _info(self) -> dict[str, float]:
        """The frame's metrics by name."""
        return dict(zip(FRAME_METRICS, self.arrays.metrics[0].tolist(), strict=True))

    def render(self) -> Any:
        """The present frame, as `trust_env.parallel_env` shows it."""
        if self.render_mode is None:
            return None
        if self._renderer is None:
            from trust_env.render import make_renderer

            self._renderer = make_renderer(self.learners.env.worlds, self.render_mode, self.metadata["render_fps"])
        return self._renderer.draw()

    def close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
        self.learners.close()

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_renderer": None}
