"""Action wrappers in `patrol`: choices of its two adversaries, and what they then inject."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from trust_env.agents import PolicyContext
from trust_env.agents.wrappers import WRAPPERS, ActionWrapper, build_wrapper
from trust_env.scenario import load_scenario
from trust_env.vector import VectorEnv, vector_env
from trust_env.world.origin import FIRST_INJECTION

VARIANTS = [*WRAPPERS, "phantoms(n=2, speed=0, frame=area)", "grid(g=3, n=7, speed=5, frame=area)"]
SHAPES: dict[str, Any] = {
    "circle": {"radius": 350.0},
    "sector": {"type": "sector", "radius": 400.0, "heading": 0.7, "width": 1.9},
    "triangle": {"type": "polygon", "vertices": [[-100.0, -50.0], [50.0, 300.0], [350.0, -20.0]]},
}
ADVERSARIES = np.array([0, 1])  # of patrol


def reset_wrapper(wrapper: Any, env: VectorEnv, agents: np.ndarray = ADVERSARIES) -> ActionWrapper:
    """The wrapper for agents of an environment that has just been reset."""
    worlds = env.arrays.world_id.reshape(-1).copy()
    mask, episodes = np.ones(len(worlds), dtype=bool), np.zeros_like(worlds)
    built = build_wrapper(wrapper)
    built.reset(PolicyContext(env.scenario, env.observation_table, agents, 1, worlds, episodes, mask))
    return built


def patrol(wrapper: Any, num_worlds: int = 1, **overrides: Any) -> tuple[VectorEnv, ActionWrapper]:
    env = vector_env(load_scenario("patrol", **overrides), "score", num_worlds, autoreset=False)
    env.reset(7)
    return env, reset_wrapper(wrapper, env)


def play(env: VectorEnv, wrapper: ActionWrapper, choices: np.ndarray) -> np.ndarray:
    """A frame in which the adversaries choose; their raw actions."""
    observations = env.arrays.observation[:, ADVERSARIES]
    actions, chosen = np.zeros_like(env.arrays.action), wrapper.act(choices, observations)
    actions[:, ADVERSARIES] = chosen
    env.step(actions)
    return chosen


def drawn(wrapper: ActionWrapper, worlds: int, seed: int) -> np.ndarray:
    """Choices of every learner, uniform in the action space."""
    space = copy.deepcopy(wrapper.action_space)
    space.seed(seed)
    return np.array([[space.sample() for _ in ADVERSARIES] for _ in range(worlds)])


def injected(env: VectorEnv, k: int) -> np.ndarray:
    """Where agent k of world 0 injected in the last frame, [n, 2] m."""
    count = int(env.arrays.report_count[0, k])
    mine = env.arrays.report_origin[0, k, :count] <= FIRST_INJECTION
    return env.arrays.report_detections[0, k, :count][mine]


def pointing(x: float, y: float, report: float = 1.0, radius: float = -1.0) -> np.ndarray:
    """Choices for both adversaries of patrol in one world: only their first phantom is there. It appears at
    (x, y) FOV radii, its own point being (1, 1) / sqrt(8).
    """
    choices = np.zeros((1, 2, 15), dtype=np.float32)
    choices[..., 0:12:3] = -1.0
    choices[..., 0], choices[..., 1:3] = report, (np.array([x, y]) - np.sqrt(0.125)) / 3.0
    choices[..., 12:] = 0.0, 0.0, radius
    return choices


def off_agent(env: VectorEnv, k: int) -> np.ndarray:
    """Where agent k of world 0 injected in the last frame, relative to it: [n, 2] m."""
    return injected(env, k) - env.arrays.pose[0, k, :2]
