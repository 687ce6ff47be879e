"""What is done with the environment. Each command of `trust-env` has its twin here.

import training
training.evaluate("patrol", attacks="honest,false_positive", defenses="score,trust")
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from training.benchmark import benchmark as benchmark
    from training.conform import conform as conform
    from training.evaluate import evaluate as evaluate
    from training.exploit import exploit as exploit
    from training.reproduce import reproduce as reproduce
    from training.search import search as search
    from training.train import train as train

__all__ = ["benchmark", "conform", "evaluate", "exploit", "reproduce", "search", "train"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        return getattr(importlib.import_module(f"training.{name}"), name)
    raise AttributeError(f"module 'training' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])


class _Package(ModuleType):
    """`training.evaluate` stays the function when somebody imports the module of that name."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in __all__ and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
