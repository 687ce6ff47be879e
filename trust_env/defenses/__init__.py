"""Defenses: they turn a frame's evidence into a verdict. One file per defense; this is the registry, and how
a defense is named.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

from trust_env.defenses.base import BuiltIn, Defense, Verdict, fits_publication
from trust_env.defenses.evidence import Evidence, Shape, TrackerBelief
from trust_env.defenses.joint_posterior import JointPosterior
from trust_env.defenses.majority import Majority
from trust_env.defenses.score import Score
from trust_env.defenses.trust import Trust
from trust_env.errors import unknown_name
from trust_env.spec import load_object, parse
from trust_env.user_code import construct, missing_methods

DEFENSES: dict[str, type[BuiltIn]] = {
    "score": Score,
    "trust": Trust,
    "majority": Majority,
    "joint_posterior": JointPosterior,
}

__all__ = [
    "DEFENSES",
    "BuiltIn",
    "Defense",
    "Evidence",
    "Shape",
    "TrackerBelief",
    "Verdict",
    "build_defense",
    "fits_publication",
]


def build_defense(defense: Any) -> BuiltIn | Defense:
    """A defense from its name (`trust(preset=cdc2024)`, `my_file.py:MyDefense(window=9)`) or from an object
    with `reset` and `update`.

    Raises ValueError for a name that gives no defense, or not with such parameters, TypeError for an object that
    is none.
    """
    built = _build_from_name(defense) if isinstance(defense, str) else defense
    fault = "" if isinstance(built, BuiltIn) else missing_methods(built, "reset(shape, worlds)", "update(evidence)")
    if fault:
        error = ValueError if isinstance(defense, str) else TypeError
        raise error(f"a defense is a name, or an object with `reset(shape, worlds)` and `update(evidence)`; {fault}")
    return built


def _build_from_name(name: str) -> Any:
    spec = parse(name)
    if spec.path is None and spec.name not in DEFENSES:
        raise unknown_name("defense", spec.name, DEFENSES)
    make = DEFENSES[spec.name] if spec.path is None else load_object(spec)
    return construct(make, spec.params) if callable(make) else make


class _Registry(ModuleType):
    """This module can be called: `trust_env.defenses()` lists what is built in."""

    def __call__(self) -> tuple[str, ...]:
        return tuple(DEFENSES)


sys.modules[__name__].__class__ = _Registry
