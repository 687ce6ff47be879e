"""A training step: PPO on our worlds, and on an environment of the same shapes that costs nothing."""

from __future__ import annotations

from typing import Any

from trust_env.training.speed.missing import require
from trust_env.training.speed.stopwatch import Run

FRAMES = 8  # of every learner in a rollout: fewer than by default, to be quick; with all learners one batch


def train_subject() -> Run:
    """Rollouts and updates of `trust-env train` as it is by default; a frame is a frame of one learner."""
    _require_all()
    from trust_env.scenario import load_scenario
    from trust_env.training.learning.ppo import build_ppo
    from trust_env.training.learning.sb3 import LearnersVecEnv
    from trust_env.training.learning.session import build_learners

    config = _configuration()
    learners = LearnersVecEnv(build_learners(config, load_scenario(config.scenario), config.worlds))
    return _updates(build_ppo(config, learners), config.threads)


def zero_cost_subject() -> Run:
    """Stable-Baselines3's own PPO with the same settings, on an environment that returns the same arrays."""
    _require_all()
    from stable_baselines3 import PPO

    from trust_env.scenario import load_scenario
    from trust_env.training.learning.ppo import ppo_settings
    from trust_env.training.learning.session import build_learners
    from trust_env.training.speed.zero_cost import ZeroCost

    config = _configuration()
    one = build_learners(config, load_scenario(config.scenario), 1)
    learners = config.worlds * one.num_learners
    env = ZeroCost(learners, one.observation_space, one.action_space)
    return _updates(PPO("MlpPolicy", env, seed=config.seed, **ppo_settings(config)), config.threads)


def _require_all() -> None:
    for module in ("torch", "stable_baselines3", "safetensors"):
        require(module, "the extra `train`")


def _configuration() -> Any:
    from trust_env.training.learning.configuration import load_configuration

    return load_configuration(overrides={"ppo.n_steps": FRAMES})


def _updates(model: Any, threads: int) -> Run:
    from stable_baselines3.common.logger import Logger

    from trust_env.training.learning.torch_state import isolated_torch

    model.set_logger(Logger(None, []))
    _, callback = model._setup_learn(10**12)
    size = model.n_steps * model.n_envs

    def run(frames: int) -> int:
        rollouts = -(-frames // size)
        with isolated_torch(threads):
            for _ in range(rollouts):
                model.collect_rollouts(model.env, callback, model.rollout_buffer, model.n_steps)
                model.train()
        return rollouts * size

    return run
