"""Actions and episodes of parallel environments, and snapshots that can be compared."""

from __future__ import annotations

from typing import Any

import numpy as np

from trust_env.parallel import TrustEnv


def random_actions(env: TrustEnv, rng: np.random.Generator, scale: float = 1.0) -> dict[str, np.ndarray]:
    """Uniform in [-scale, scale]."""
    shape = env.action_space(env.possible_agents[0]).shape
    return {agent: (scale * rng.uniform(-1, 1, shape)).astype(np.float32) for agent in env.agents}


def zero_actions(env: TrustEnv) -> dict[str, np.ndarray]:
    """The actions that do nothing."""
    return {agent: np.zeros(env.action_space(agent).shape, np.float32) for agent in env.agents}


def snapshot(env: TrustEnv) -> tuple[bytes, tuple[str, ...], bool]:
    """All state, in a form that can be compared exactly."""
    state = env.get_state()
    return state["row"].tobytes(), tuple(state["agents"]), state["started"]


def play(env: TrustEnv, rng: np.random.Generator, frames: int) -> list[Any]:
    """All results of random actions until the episode ends, in a form that can be compared exactly."""
    results = []
    for _ in range(frames):
        observations, *rest = env.step(random_actions(env, rng))
        results.append(({a: o.tobytes() for a, o in observations.items()}, *rest, env.state().tobytes()))
        if not env.agents:
            break
    return results
