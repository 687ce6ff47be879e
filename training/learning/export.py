"""The policy of an algorithm as a policy file: weights and a plain config."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import MultiDiscrete
from stable_baselines3 import PPO

import trust_env
from trust_env.agents.learned.policy_file import save_policy
from trust_env.defenses import named_in_full
from trust_env.parallel import TrustEnv
from trust_env.training.learning.configuration import Configuration
from trust_env.training.learning.learners import Learners


def export_policy(path: Path, model: PPO, learners: Learners, config: Configuration) -> None:
    """Write the learners' present policy as a policy file; into a folder as its policy.safetensors."""
    space, wrapper = learners.action_space, learners.wrapper
    tensors = policy_tensors(model)
    sizes = [tensors[f"pi.{i}.weight"].shape[0] for i in range(len(config.network.layers))]
    save_policy(
        path,
        tensors,
        {
            "wrapper": str(wrapper),
            "knowledge": wrapper.knowledge,
            "fields": wrapper.fields,
            "layers": [wrapper.observation_size, *sizes, tensors["action.bias"].shape[0]],
            "activation": config.network.activation,
            "choices": space.nvec.tolist() if isinstance(space, MultiDiscrete) else None,
            "about": _about(model, learners, config),
        },
    )


def policy_tensors(model: PPO) -> dict[str, np.ndarray]:
    """pi.i.weight, pi.i.bias, action.weight, action.bias, log_std or not, obs_mean and obs_var or not."""
    weights = {name: tensor.detach().numpy() for name, tensor in model.policy.state_dict().items()}
    tensors = {f"action.{part}": weights[f"action_net.{part}"] for part in ("weight", "bias")}
    tensors |= _hidden_layers(weights)
    if "log_std" in weights:
        tensors["log_std"] = weights["log_std"]
    normalised = model.get_vec_normalize_env()
    if normalised is not None and normalised.norm_obs:
        tensors |= {"obs_mean": normalised.obs_rms.mean, "obs_var": normalised.obs_rms.var}  # type: ignore
    return tensors


def _hidden_layers(weights: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Every second module of SB3's `policy_net` is an activation."""
    start, found = "mlp_extractor.policy_net.", {}
    for name, values in weights.items():
        if name.startswith(start):
            module, _, part = name.removeprefix(start).partition(".")
            found[f"pi.{int(module) // 2}.{part}"] = values
    return found


def _about(model: PPO, learners: Learners, config: Configuration) -> dict[str, Any]:
    return {
        "scenario": learners.scenario.name,
        "defense": named_in_full(config.defense),
        "role": config.role,
        "seed": config.seed,
        "steps": model.num_timesteps,
        "package": trust_env.__version__,
        "version": TrustEnv.metadata["name"],
    }
