"""How long a step of the environment takes with a defense, compared with the track score alone."""

from __future__ import annotations

import time

from trust_env.agents import Player, build_policy
from trust_env.defenses import build_defense
from trust_env.scenario import Scenario
from trust_env.vector import VectorEnv

BASELINE = "score"
WORLDS, WARM_UP, FRAMES, ROUNDS = 16, 30, 20, 3


def time_ratio(scenario: Scenario, defense: str) -> float:
    """Seconds of a step with a defense over those with `score`, all agents honest, in the same process."""
    return step_seconds(scenario, defense) / step_seconds(scenario, BASELINE)


def step_seconds(scenario: Scenario, defense: str) -> float:
    """Seconds of a step of a batch of worlds: the least mean of some rounds of frames."""
    venv = VectorEnv(scenario, build_defense(defense), WORLDS, autoreset=False)
    try:
        player = Player(venv, {"adversary": build_policy("honest")})
        observations, _ = venv.reset(0)
        rounds = []
        for frames in (WARM_UP, *[FRAMES] * ROUNDS):
            spent = 0.0
            for _ in range(frames):
                actions = player.actions(observations)
                begun = time.perf_counter()
                observations, *_ = venv.step(actions)
                spent += time.perf_counter() - begun
            rounds.append(spent / frames)
        return min(rounds[1:])
    finally:
        venv.close()
