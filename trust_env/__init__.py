"""trust-env: attack and defend a multi-agent tracking centre, as a PettingZoo environment.

Names are imported when they are first used, so that `import trust_env` costs nothing: no compiler, no torch,
no drawing library.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from trust_env.defenses.base import Evidence, Shape, Verdict
    from trust_env.fusion_centre import FusionCentre, replay_evidence
    from trust_env.parallel import env, parallel_env, raw_env
    from trust_env.scenario import Scenario, ScenarioError, load_scenario, scenarios
    from trust_env.vector import vector_env

    def defenses() -> tuple[str, ...]: ...


_HOMES = {
    "Evidence": "defenses.base",
    "Shape": "defenses.base",
    "Verdict": "defenses.base",
    "FusionCentre": "fusion_centre",
    "replay_evidence": "fusion_centre",
    "env": "parallel",
    "parallel_env": "parallel",
    "raw_env": "parallel",
    "Scenario": "scenario",
    "ScenarioError": "scenario",
    "load_scenario": "scenario",
    "scenarios": "scenario",
    "vector_env": "vector",
}

__all__ = [
    "Evidence",
    "FusionCentre",
    "Scenario",
    "ScenarioError",
    "Shape",
    "Verdict",
    "defenses",
    "env",
    "load_scenario",
    "parallel_env",
    "raw_env",
    "replay_evidence",
    "scenarios",
    "vector_env",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(f"trust_env.{_HOMES[name]}"), name)
    # `trust_env.defenses()` lists what is built in: a module that can be called.
    if name in ("agents", "conformance", "defenses", "metrics", "theory", "training"):
        return importlib.import_module(f"trust_env.{name}")
    raise AttributeError(f"module 'trust_env' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
