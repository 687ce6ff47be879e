"""How long a step of the environment takes with a defense, compared with the track score alone."""

from __future__ import annotations

from trust_env.defenses import build_defense
from trust_env.scenario import Scenario
from trust_env.training.speed.stopwatch import measure, ratio
from trust_env.training.speed.subjects import vector_subject
from trust_env.vector import VectorEnv

BASELINE = "score"
WORLDS, TURNS, SECONDS = 16, 9, 0.05


def time_ratio(scenario: Scenario, defense: str) -> float:
    """Seconds of a step with a defense over those with `score`: one thread, all agents honest.

    Both take turns, and the median of the turns' ratios counts, so that what else the machine does counts little.
    """
    venvs = [VectorEnv(scenario, build_defense(name), WORLDS, threads=1) for name in (defense, BASELINE)]
    try:
        own, baseline = (vector_subject(venv, attacked=False) for venv in venvs)
        rates = measure({"own": own, "baseline": baseline}, TURNS, SECONDS)
    finally:
        for venv in venvs:
            venv.close()
    return ratio(rates, "baseline", "own").median
