"""Policies: what chooses the agents' actions. One file per family; here the registry, and how they are named.

An attack is a policy of adversaries; `honest` is the control. A policy of your own is a class with a method
`choose` (see `Policy`), in a file of yours: `build_policy("my_file.py:MyPolicy(x=3)")`. A trained one is the
folder of its run: `build_policy("runs/a")`.
"""

from __future__ import annotations

import os
from typing import Any

from trust_env.agents.attacks.baseline import Honest, Random
from trust_env.agents.attacks.false_positive import FalsePositive
from trust_env.agents.attacks.shared_false_positives import FovAware, OptimalFalsePositive
from trust_env.agents.attacks.suppression import Suppress
from trust_env.agents.attacks.timing import OnOff, Sleeper
from trust_env.agents.base import (
    Policy,
    PolicyContext,
    PolicyLike,
    check_knowledge,
    knowledge_of,
    name_of,
    sufficient_knowledge,
)
from trust_env.agents.learned.policy import Learned
from trust_env.agents.parameters import made
from trust_env.agents.player import Player
from trust_env.errors import unknown_name
from trust_env.spec import Spec, load_object, parse

POLICIES: dict[str, type[Policy]] = {
    "honest": Honest,
    "random": Random,
    "false_positive": FalsePositive,
    "optimal_false_positive": OptimalFalsePositive,
    "suppress": Suppress,
    "fov_aware": FovAware,
    "sleeper": Sleeper,
    "on_off": OnOff,
    "learned": Learned,
}

__all__ = [
    "POLICIES",
    "Player",
    "Policy",
    "PolicyContext",
    "PolicyLike",
    "build_policy",
    "check_knowledge",
    "is_run",
    "knowledge_of",
    "name_of",
    "parse_policy",
    "policies",
    "sufficient_knowledge",
]


def policies() -> tuple[str, ...]:
    """The names of what is built in."""
    return tuple(POLICIES)


def build_policy(policy: Any) -> PolicyLike:
    """A policy from its name (`false_positive(n=2)`, `my_file.py:MyPolicy(x=3)`, `runs/a`, the folder of a
    training run), or an object that is one.

    Raises ValueError for an unknown name, and for a parameter that is unknown or does not fit; TypeError for
    something that is no policy.
    """
    if isinstance(policy, str):
        spec = parse_policy(policy)
        if spec.path is None and spec.name not in POLICIES:
            raise unknown_name("policy", spec.name, POLICIES)
        make = load_object(spec) if spec.path is not None else POLICIES[spec.name]
        policy = made("policy", spec.name, make, spec.params) if callable(make) else make
    if isinstance(policy, type) or not isinstance(policy, PolicyLike):
        raise TypeError(
            f"a policy is a name, or an object with `reset(context)` and `act(observations)`; got {policy!r}"
        )
    return policy


def parse_policy(text: str) -> Spec:
    """As `trust_env.spec.parse`, but a training run, `runs/a`, is `learned(path='runs/a')`."""
    if text.strip().startswith("search("):
        raise ValueError(
            f"{text}: a search has to be run before it can be played; expected what `trust-env exploit` or "
            "`training.search` has found, such as false_positive(n=2)"
        )
    return Spec("learned", {"path": text.strip()}) if is_run(text) else parse(text)


def is_run(text: str) -> bool:
    """Whether a text names a training run: a policy file, or a folder and not a policy."""
    text = text.strip()
    if text.endswith(".safetensors"):
        return "(" not in text
    if "(" in text or ".py:" in text or text in POLICIES:
        return False
    return "/" in text or os.sep in text or os.path.isdir(text)
