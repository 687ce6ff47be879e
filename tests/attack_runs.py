"""Attacks played against `score`, and what they then injected: shared by the tests of policies."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from trust_env.agents import POLICIES, Player, build_policy, sufficient_knowledge
from trust_env.scenario import Scenario, load_scenario
from trust_env.vector import VectorEnv

SCRIPTED = [name for name, policy in POLICIES.items() if policy.scripted]  # tested in learned/
VARIANTS = [
    *SCRIPTED,
    "false_positive(motion=constant_velocity, speed=60)",
    "false_positive(motion=random_walk, n=2)",
    "false_positive(motion=pace, share=True, n=6, suppress=0.5)",
    "optimal_false_positive(n=3, hit_rate=0.5)",
    "suppress(choice=nearest, fraction=0.3)",
    "suppress(choice=all)",
    "collusion(n=1)",
    "replay(lag=2, n=2)",
    "flood(stack=True)",
    "fov_aware(max_honest=1, n=3)",
    "fov_aware(n=7, motion=constant_velocity, speed=60)",
    "outward(motion=constant_velocity, speed=60, noise=None)",
    "by_turns(per_slot=2, motion=pace, noise=3)",
    "sleeper(start=2, inner=suppress)",
    "on_off(period=4, inner=fov_aware(n=1))",
]
SHAPES: dict[str, Any] = {
    "circle": {"radius": 350.0},
    "sector": {"type": "sector", "radius": 400.0, "heading": 0.7, "width": 1.9},
    "wide sector": {"type": "sector", "radius": 400.0, "heading": -2.0, "width": 4.0},
    "triangle": {"type": "polygon", "vertices": [[-100.0, -50.0], [50.0, 300.0], [350.0, -20.0]]},
    "pentagon": {
        "type": "polygon",
        "vertices": [[200, 0], [60, 190], [-160, 120], [-160, -120], [60, -190]],
    },
}


def patrol_for(attack: str) -> Scenario:
    """`patrol` at the knowledge level that an attack needs, `poses` at least."""
    scenario = load_scenario("patrol", knowledge="poses")
    return load_scenario(scenario, knowledge=sufficient_knowledge(scenario, build_policy(attack)))


def quiet(agents: list[dict[str, Any]], **changes: Any) -> dict[str, Any]:
    """A scenario with perfect sensors: no clutter, no misses, little noise; no targets unless given."""
    sensor = {"p_detect": 1.0, "sigma": 0.5, "noise_cov": None, "clutter_density": 0.0, "max_detections": 8}
    scenario = {"base": "theorem", "name": "quiet", "dt": 1.0, "agents": agents, "sensor": sensor}
    return scenario | {"injection": {"slots": 3}, "area": [-500.0, 500.0, -500.0, 500.0]} | changes


def play(
    scenario: Any, attack: Any, frames: int, worlds: int = 1, seed: int = 3, **reset: Any
) -> Iterator[tuple[VectorEnv, np.ndarray]]:
    """The environment and the actions after every frame of an attack against `score`."""
    env = VectorEnv(scenario, "score", worlds, autoreset=False)
    player = Player(env, {"adversary": attack})
    observations, _ = env.reset(seed, **reset)
    for _ in range(frames):
        actions = player.actions(observations)
        observations, *_ = env.step(actions)
        yield env, actions


def injected(env: VectorEnv) -> np.ndarray:
    """The points that adversaries have injected in the last frame, [W, K, D, 2] m; NaN elsewhere."""
    there = np.arange(env.arrays.report_detections.shape[2]) < env.arrays.report_count[..., None]
    fake = there & (env.arrays.report_origin <= -2)
    return np.where(fake[..., None], env.arrays.report_detections, np.nan)


def observers(env: VectorEnv, points: np.ndarray, role: str) -> np.ndarray:
    """How many agents of a role have each of the points[W, ..., 2] in their circular FOVs, [W, ...]."""
    counts = np.zeros(points.shape[:-1], dtype=int)
    for k, other in enumerate(env.scenario.roles):
        if other == role:
            position = env.arrays.pose[:, k, :2].reshape(len(points), *[1] * (points.ndim - 2), 2)
            counts += np.linalg.norm(points - position, axis=-1) <= env.scenario.agent(k).fov.radius
    return counts
