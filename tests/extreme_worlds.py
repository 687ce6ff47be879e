"""Worlds of extreme scenarios, played under random attacks and defenses, and checked in every frame."""

from __future__ import annotations

import numpy as np
from invariants import check

import trust_env
from trust_env.scenario import Scenario

DEFENSES = (
    "score",
    "trust",
    "trust(preset=cdc2024)",
    "trust(preset=mate)",
    "trust(agent_negativity_bias=3.0)",
    "majority",
    "majority(window=1, q=0.0)",
    "majority(window=40)",
)


def play(scenario: Scenario, rng: np.random.Generator, frames: int, worlds: int = 2) -> None:
    """Play random frames under a random defense; raises where something does not hold."""
    env = trust_env.vector_env(scenario, str(rng.choice(DEFENSES)), num_worlds=worlds, threads=1)
    with np.errstate(over="raise", invalid="raise"):
        env.reset(seed=int(rng.integers(2**63)))
        check(env)
        actions = np.zeros(env.arrays.action.shape)
        for frame in range(frames):
            if frame % 3 == 0:  # the same point injected for three frames makes tracks
                actions = rng.uniform(-1, 1, actions.shape) * rng.choice([0.0, 1.0, 1e9])
                actions[..., -scenario.sensor.max_detections :] -= rng.choice([0.0, 0.8])
            _, reward, _, _, info = env.step(actions)
            assert all(np.isfinite(value).all() for name, value in info.items() if name != "agent_trust")
            assert np.isfinite(reward).all()
            check(env)
    env.close()
