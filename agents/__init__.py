"""Policies: what chooses the agents' actions. One file per family; here the registry, and how they are named.

An attack is a policy of adversaries; `honest` is the control. A policy of your own is a class with a method
`choose` (see `Policy`), in a file of yours: `build_policy("my_file.py:MyPolicy(x=3)")`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from agents.baseline import Honest, Random
from agents.coalition import FovAware, OptimalFalsePositive
from agents.phantoms import FalsePositive
from agents.player import Player
from agents.policy import (
    Policy,
    PolicyContext,
    PolicyLike,
    check_knowledge,
    knowledge_of,
    name_of,
    sufficient_knowledge,
)
from agents.suppression import Suppress
from agents.timing import OnOff, Sleeper
from trust_env.errors import suggestion, unknown_name
from trust_env.spec import load_object, parse

POLICIES: dict[str, type[Policy]] = {
    "honest": Honest,
    "random": Random,
    "false_positive": FalsePositive,
    "optimal_false_positive": OptimalFalsePositive,
    "suppress": Suppress,
    "fov_aware": FovAware,
    "sleeper": Sleeper,
    "on_off": OnOff,
}

__all__ = [
    "POLICIES",
    "Player",
    "Policy",
    "PolicyContext",
    "PolicyLike",
    "build_policy",
    "check_knowledge",
    "knowledge_of",
    "name_of",
    "policies",
    "sufficient_knowledge",
]


def policies() -> tuple[str, ...]:
    """The names of what is built in."""
    return tuple(POLICIES)


def build_policy(policy: Any) -> PolicyLike:
    """A policy from its name (`false_positive(n=2)`, `my_file.py:MyPolicy(x=3)`), or an object that is one.

    Raises ValueError for an unknown name, and for a parameter that is unknown or does not fit; TypeError for
    something that is no policy.
    """
    if isinstance(policy, str):
        spec = parse(policy)
        if spec.path is None and spec.name not in POLICIES:
            raise unknown_name("policy", spec.name, POLICIES)
        made = load_object(spec) if spec.path is not None else POLICIES[spec.name]
        policy = _made(spec.name, made, spec.params) if callable(made) else made
    if isinstance(policy, type) or not isinstance(policy, PolicyLike):
        raise TypeError(
            f"a policy is a name, or an object with `reset(context)` and `act(observations)`; got {policy!r}"
        )
    return policy


def _made(name: str, make: Callable[..., Any], params: Mapping[str, Any]) -> Any:
    signature = inspect.signature(make)
    known = [p.name for p in signature.parameters.values() if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    takes_all = any(p.kind is p.VAR_KEYWORD for p in signature.parameters.values())
    for key in params:
        if key not in known and not takes_all:
            hint = f"{suggestion(key, known)}it takes: {', '.join(known) or 'none'}"
            raise ValueError(f"policy {name!r} has no parameter {key!r}; {hint}")
    try:
        signature.bind(**params)
    except TypeError as error:
        raise ValueError(f"policy {name!r}: {error}; it takes: {', '.join(known) or 'none'}") from None
    return make(**params)
