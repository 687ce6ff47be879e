"""How long a step of the environment takes with a defense, compared with the track score alone."""

from __future__ import annotations

import time
from collections.abc import Iterator

from trust_env.agents import Player, build_policy
from trust_env.defenses import build_defense
from trust_env.scenario import Scenario
from trust_env.vector import VectorEnv

BASELINE = "score"
WORLDS, WARM_UP, FRAMES, ROUNDS = 16, 30, 10, 5


def time_ratio(scenario: Scenario, defense: str) -> float:
    """Processor seconds of a step with a defense over those with `score`: one thread, all agents honest.

    Both are the least of some rounds, which alternate, so that what else the machine does counts little.
    """
    rounds = list(zip(_rounds(scenario, defense), _rounds(scenario, BASELINE)))
    return min(own for own, _ in rounds) / min(baseline for _, baseline in rounds)


def _rounds(scenario: Scenario, defense: str) -> Iterator[float]:
    """Processor seconds of some frames of a batch of worlds, of every round."""
    venv = VectorEnv(scenario, build_defense(defense), WORLDS, autoreset=False, threads=1)
    try:
        player = Player(venv, {"adversary": build_policy("honest")})
        observations, _ = venv.reset(0)
        for frames in (WARM_UP, *[FRAMES] * ROUNDS):
            spent = 0.0
            for _ in range(frames):
                actions = player.actions(observations)
                begun = time.process_time()
                observations, *_ = venv.step(actions)
                spent += time.process_time() - begun
            if frames != WARM_UP:
                yield spent
    finally:
        venv.close()
