"""Policy files of random weights, good and bad, and what agents do with them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy

from trust_env.agents import Player, PolicyContext
from trust_env.agents.learned.policy_checks import tensor_shapes
from trust_env.agents.learned.policy_file import save_policy
from trust_env.agents.wrappers import build_wrapper
from trust_env.vector import VectorEnv

SCENARIO = "trio(horizon=12)"


def write_fitting(
    path: Any, wrapper: str = "phantoms(n=2)", scenario: str = SCENARIO, seed: int = 0, **config: Any
) -> Any:
    """The path of a written policy of random weights that fits a scenario, but for what `config` changes."""
    env = VectorEnv(scenario, "score", 1)
    agents = np.array([k for k, role in enumerate(env.scenario.roles) if role == "adversary"])
    one = np.zeros(1, dtype=np.int64)
    built = build_wrapper(wrapper)
    built.reset(PolicyContext(env.scenario, env.observation_table, agents, 0, one, one, np.ones(1, dtype=bool)))
    choices = getattr(built.action_space, "nvec", None)
    choices = None if choices is None else choices.tolist()
    outputs = built.action_space.shape[0] if choices is None else sum(choices)  # type: ignore[index]
    config = {
        "wrapper": str(built),
        "knowledge": env.scenario.knowledge,
        "fields": dict(built.fields),
        "layers": [built.observation_size, 16, 8, outputs],
        "activation": "tanh",
        "choices": choices,
        "about": {"scenario": "trio", "defense": "score", "seed": seed, "steps": 0},
    } | config
    save_policy(path, weights(config["layers"], config["choices"], seed), config)
    return path


def weights(layers: list[int], choices: list[int] | None, seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    shapes = tensor_shapes(layers, choices, True)
    tensors: dict[str, Any] = {name: rng.normal(0.0, 0.5, shape).astype(np.float32) for name, shape in shapes.items()}
    tensors["obs_var"] = rng.uniform(0.2, 2.0, layers[0])  # float64
    return tensors


SMALL_CONFIG: dict[str, Any] = {
    "wrapper": "raw",
    "knowledge": "own",
    "fields": {"pose": 4},
    "layers": [4, 3, 2],
    "activation": "relu",
    "choices": None,
    "about": {"steps": 10},
}


def write_small(path: Path) -> Path:
    """A small file, which no scenario fits."""
    save_policy(path, weights(SMALL_CONFIG["layers"], None), SMALL_CONFIG)
    return path


def write_unchecked(path: Path, tensors: dict[str, Any] | None = None, metadata: Any = None, **config: Any) -> Path:
    """A file that `save_policy` would refuse to write."""
    text = json.dumps({"format": 1, **SMALL_CONFIG, **config})
    found = weights(SMALL_CONFIG["layers"], None) | (tensors or {})
    data = safetensors.numpy.save(
        {name: values for name, values in found.items() if values is not None},
        {"trust_env": text} if metadata is None else metadata,
    )
    path.write_bytes(data)
    return path


def actions_of(
    attack: Any, worlds: np.ndarray, scenario: str = SCENARIO, frames: int = 12, seed: int = 5
) -> np.ndarray:
    """What all agents do, [frames, W, K, A], in worlds of the given numbers."""
    env = VectorEnv(scenario, "score", len(worlds), autoreset=False)
    player, played = Player(env, {"adversary": attack}), []
    observations, _ = env.reset(seed, options={"worlds": worlds})
    for _ in range(frames):
        played.append(player.actions(observations))
        observations, *_ = env.step(played[-1])
    return np.stack(played)
