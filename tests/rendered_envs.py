"""Environments with a render mode after some frames, the actions they take, and the colours they show."""

from __future__ import annotations

from typing import Any

import numpy as np

import trust_env
from trust_env.parallel import TrustEnv
from trust_env.render.scene import read_scene
from trust_env.spaces.action import ActionTable


def rendered_env(
    scenario: Any = "case1",
    mode: str = "rgb_array",
    frames: int = 0,
    attack: bool = True,
    defense: str = "trust",
) -> TrustEnv:
    """An environment after so many frames."""
    env = trust_env.parallel_env(scenario, defense, render_mode=mode)
    env.reset(seed=1)
    for _ in range(frames):
        env.step(choose_actions(env, attack))
    return env


def choose_actions(env: TrustEnv, attack: bool) -> dict[str, np.ndarray]:
    """All zero; with `attack` adversaries make the scenario's injections, or one each where it has none."""
    zero = np.zeros(env.action_space(env.possible_agents[0]).shape, dtype=np.float32)
    actions = dict.fromkeys(env.possible_agents, zero)
    for k, role in enumerate(env.scenario.roles):
        if attack and role == "adversary":
            own = [list(i.position) for i in env.scenario.injections if i.agent == k]
            positions = np.array(own or [env.arrays.pose[0, k, :2] + 30.0])
            actions[env.possible_agents[k]] = ActionTable(env.scenario).encode(env.arrays.fov_box[0, k], positions)
    return actions


def pixel(env: TrustEnv, image: np.ndarray, position: Any) -> np.ndarray:
    """The colour of the image at a position given in metres."""
    from trust_env.render.camera import Camera
    from trust_env.render.image import MAP_SIZE

    x, y = Camera(read_scene(env.worlds).extent, (0, 0, MAP_SIZE, MAP_SIZE)).pixels(np.asarray(position))
    return image[int(y), int(x)].astype(int)


def similar(colour: Any, other: Any, tolerance: int = 40) -> bool:
    """Whether no channel differs by more than the tolerance."""
    return bool(np.abs(np.asarray(colour, dtype=int) - np.asarray(other)).max() <= tolerance)
