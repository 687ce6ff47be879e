"""Defenses: they turn a frame's evidence into a verdict. One file per defense; this is the registry, and how
a defense is named.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

from trust_env.defenses.base import BuiltIn, Defense, Verdict, fits_publication
from trust_env.defenses.binary_beta import BinaryBeta
from trust_env.defenses.cusum import Cusum
from trust_env.defenses.dawid_skene import DawidSkene
from trust_env.defenses.evidence import Evidence, Shape, TrackerBelief
from trust_env.defenses.joint_posterior import JointPosterior
from trust_env.defenses.majority import Majority
from trust_env.defenses.parsimony import Parsimony
from trust_env.defenses.particle import Particle
from trust_env.defenses.path_trust import PathTrust
from trust_env.defenses.quorum import Quorum
from trust_env.defenses.references import Blank, Oracle
from trust_env.defenses.rfsn_beta import RfsnBeta
from trust_env.defenses.score import Score
from trust_env.defenses.score_asymmetry import ScoreAsymmetry
from trust_env.defenses.trust import Trust
from trust_env.errors import unknown_name
from trust_env.spec import Spec, load_object, parse
from trust_env.user_code import construct, missing_methods

DEFENSES: dict[str, type[BuiltIn]] = {
    "score": Score,
    "trust": Trust,
    "majority": Majority,
    "quorum": Quorum,
    "binary_beta": BinaryBeta,
    "rfsn_beta": RfsnBeta,
    "particle": Particle,
    "parsimony": Parsimony,
    "score_asymmetry": ScoreAsymmetry,
    "dawid_skene": DawidSkene,
    "path_trust": PathTrust,
    "cusum": Cusum,
    "joint_posterior": JointPosterior,
    "oracle": Oracle,
    "blank": Blank,
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
    "name_of",
    "named_in_full",
    "refuse_reference",
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


def refuse_reference(defense: BuiltIn | Defense, use: str) -> None:
    """ValueError for a built-in defense that is for evaluation only; `use` says what it is refused for."""
    if isinstance(defense, BuiltIn) and defense.reference:
        raise ValueError(f"the defense {type(defense).__name__} is for evaluation only; {use} takes any other")


def named_in_full(name: str) -> str:
    """A defense's name with the preset that it gets where it names none: `trust` becomes `trust(preset=paper)`."""
    spec = parse(name)
    presets = () if spec.path is not None or spec.name not in DEFENSES else tuple(DEFENSES[spec.name].presets())
    params = {"preset": presets[0], **spec.params} if presets else spec.params
    return str(Spec(spec.name, params, spec.path))


def name_of(defense: Any) -> str:
    """What pictures call a defense: its name, a user's own by its class, and its preset if it has one."""
    preset = defense.params().get("preset") if isinstance(defense, BuiltIn) else None
    known = {built_in: name for name, built_in in DEFENSES.items()}
    name = known.get(type(defense), type(defense).__name__.lower())
    return name if preset is None else f"{name}(preset={preset})"


class _Registry(ModuleType):
    """This module can be called: `trust_env.defenses()` lists what is built in."""

    def __call__(self) -> tuple[str, ...]:
        return tuple(DEFENSES)


sys.modules[__name__].__class__ = _Registry
