"""PPO of Stable-Baselines3 for hundreds of learners at once, with a state to save and restore."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch as th
from gymnasium.spaces import Box, Discrete
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from trust_env.training.learning.configuration import Configuration
from trust_env.training.learning.distribution import GroupedPolicy
from trust_env.training.learning.sb3 import LearnersVecEnv
from trust_env.training.learning.torch_state import (
    get_random_state,
    set_random_state,
    to_arrays,
    to_tensors,
    torch_threads,
)

ACTIVATIONS = {"tanh": th.nn.Tanh, "relu": th.nn.ReLU}
_COUNTS = ("num_timesteps", "_n_updates", "_current_progress_remaining")


class LearnersPPO(PPO):
    """`PPO` whose rollouts ask for the values of all final observations at once, not one by one.

    A rollout leaves torch one thread: its others would wait, awake, on the processors that step the worlds.
    """

    def collect_rollouts(
        self, env: VecEnv, callback: BaseCallback, rollout_buffer: RolloutBuffer, n_rollout_steps: int
    ) -> bool:
        """As in `OnPolicyAlgorithm`, without its loops over the learners."""
        self.policy.set_training_mode(False)
        rollout_buffer.reset()
        callback.on_rollout_start()
        with torch_threads(1), th.no_grad():
            for _ in range(n_rollout_steps):
                if not self._collect_frame(env, callback, rollout_buffer):
                    return False
            values = self.policy.predict_values(self._tensor(self._last_obs))
        assert self._last_episode_starts is not None
        rollout_buffer.compute_returns_and_advantage(values, self._last_episode_starts)
        callback.on_rollout_end()
        return True

    def _collect_frame(self, env: VecEnv, callback: BaseCallback, buffer: RolloutBuffer) -> bool:
        """A frame of all learners; False if the callback stops the rollout."""
        sampled, values, log_probs = self.policy(self._tensor(self._last_obs))
        actions = sampled.numpy()
        observations, rewards, dones, infos = env.step(self._within_space(actions))
        self.num_timesteps += env.num_envs
        if not callback.on_step():
            return False
        ended = np.flatnonzero(dones).tolist()
        if ended:
            self._update_info_buffer([infos[i] for i in ended])
            self._bootstrap(rewards, [i for i in ended if infos[i].get("TimeLimit.truncated")], infos)
        if isinstance(self.action_space, Discrete):
            actions = actions.reshape(-1, 1)
        buffer.add(self._last_obs, actions, rewards, self._last_episode_starts, values, log_probs)  # type: ignore
        self._last_obs, self._last_episode_starts = observations, dones  # type: ignore[assignment]
        return True

    def _bootstrap(self, rewards: np.ndarray, truncated: list[int], infos: list[dict[str, Any]]) -> None:
        """Add the value of the last observation to the last reward of truncated episodes."""
        if truncated:
            final = np.stack([infos[i]["terminal_observation"] for i in truncated])
            rewards[truncated] += self.gamma * self.policy.predict_values(self._tensor(final)).numpy()[:, 0]

    def _within_space(self, actions: np.ndarray) -> np.ndarray:
        if isinstance(self.action_space, Box):
            return np.clip(actions, self.action_space.low, self.action_space.high)
        return actions

    def _tensor(self, observations: Any) -> th.Tensor:
        return th.as_tensor(observations, device=self.device)

    # --- the state between two rollouts, from which training continues bit for bit ---

    def get_state(self) -> dict[str, Any]:
        """Arrays and built-in values: weights, optimiser, counts, statistics, worlds and random states."""
        normalised, learners = _environments(self)
        return {
            "policy": to_arrays(self.policy.state_dict()),
            "optimiser": to_arrays(self.policy.optimizer.state_dict()),
            "counts": {name: getattr(self, name) for name in _COUNTS},
            "last_obs": np.array(self._last_obs),
            "last_episode_starts": np.array(self._last_episode_starts),
            "episodes": list(self.ep_info_buffer or ()),
            "statistics": _statistics(normalised),
            "learners": learners.get_state(),
            "random": get_random_state(),
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Continue from the state of an algorithm that was configured in the same way."""
        normalised, learners = _environments(self)
        self.policy.load_state_dict(to_tensors(state["policy"]))
        self.policy.optimizer.load_state_dict(to_tensors(state["optimiser"]))
        for name in _COUNTS:
            setattr(self, name, state["counts"][name])
        self._last_obs, self._last_episode_starts = state["last_obs"], state["last_episode_starts"]
        assert self.ep_info_buffer is not None
        self.ep_info_buffer.clear()
        self.ep_info_buffer.extend(state["episodes"])
        _set_statistics(normalised, state["statistics"])
        learners.set_state(state["learners"])
        set_random_state(state["random"])


def build_ppo(config: Configuration, learners: LearnersVecEnv) -> LearnersPPO:
    """The algorithm as configured, at its first step; seeds all random number generators."""
    env = VecNormalize(
        learners,
        norm_obs=config.normalise.observations,
        norm_reward=config.normalise.rewards,
        gamma=config.ppo.gamma,
    )
    model = LearnersPPO(GroupedPolicy, env, seed=config.seed, **ppo_settings(config))
    first = learners.learners.wrapper.first_logits
    if first is not None:
        assert isinstance(model.policy.action_net, th.nn.Linear)
        model.policy.action_net.bias.data.copy_(th.as_tensor(first))
    learners.seed(config.world_seed)  # after the algorithm, which seeds its environments as itself
    return model


def ppo_settings(config: Configuration) -> dict[str, Any]:
    """What is configured, as Stable-Baselines3 takes it."""
    settings, network = config.ppo.model_dump(), config.network
    rates = settings.pop("learning_rate"), settings.pop("final_learning_rate")
    return settings | {
        "learning_rate": LinearSchedule(*rates, end_fraction=1.0),
        "policy_kwargs": {
            "net_arch": list(network.layers),
            "activation_fn": ACTIVATIONS[network.activation],
            "log_std_init": network.log_std,
        },
        "device": "cpu",
    }


def _environments(model: PPO) -> tuple[VecNormalize, LearnersVecEnv]:
    normalised = model.get_vec_normalize_env()
    assert normalised is not None
    assert isinstance(normalised.venv, LearnersVecEnv)
    return normalised, normalised.venv


def _statistics(env: VecNormalize) -> dict[str, Any]:
    found = {"returns": env.returns.copy(), "rewards": vars(env.ret_rms).copy()}
    return found | ({"observations": vars(env.obs_rms).copy()} if env.norm_obs else {})


def _set_statistics(env: VecNormalize, found: Mapping[str, Any]) -> None:
    env.returns = found["returns"]
    vars(env.ret_rms).update(found["rewards"])
    if env.norm_obs:
        vars(env.obs_rms).update(found["observations"])
