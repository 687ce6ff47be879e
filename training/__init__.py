"""What is done with the environment. Each command of `trust-env` has its twin here.

from trust_env import training
training.evaluate("patrol", attacks="honest,false_positive", defenses="score,trust")
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trust_env.training.curves.curve import curve as curve
    from trust_env.training.evaluation.conform import conform as conform
    from trust_env.training.evaluation.evaluate import evaluate as evaluate
    from trust_env.training.exploitation.exploit import exploit as exploit
    from trust_env.training.exploitation.search import search as search
    from trust_env.training.learning.seeds import train_seeds as train_seeds
    from trust_env.training.learning.train import train as train
    from trust_env.training.paper.reproduce import reproduce as reproduce
    from trust_env.training.ranking.rank import rank as rank
    from trust_env.training.ranking.searching import search_attacks as search_attacks
    from trust_env.training.replays.replay import replay as replay
    from trust_env.training.reports.report import report as report
    from trust_env.training.speed.benchmark import benchmark as benchmark

if __name__ != "trust_env.training":  # in the repository this folder could be imported a second time
    raise ImportError("this is trust_env.training: import it by that name")

_HOMES = {
    "benchmark": "speed.benchmark",
    "conform": "evaluation.conform",
    "curve": "curves.curve",
    "evaluate": "evaluation.evaluate",
    "exploit": "exploitation.exploit",
    "rank": "ranking.rank",
    "replay": "replays.replay",
    "report": "reports.report",
    "reproduce": "paper.reproduce",
    "search": "exploitation.search",
    "search_attacks": "ranking.searching",
    "train": "learning.train",
    "train_seeds": "learning.seeds",
}

__all__ = [
    "benchmark", "conform", "curve", "evaluate", "exploit", "rank", "replay", "report", "reproduce", "search",
    "search_attacks", "train", "train_seeds",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(f"trust_env.training.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
