"""Policies by name. A new attack is one file, and one line in `POLICIES`."""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping
from typing import Any

from trust_env.agents.attacks.baseline import Honest, Random
from trust_env.agents.attacks.by_turns import ByTurns
from trust_env.agents.attacks.false_positive import Burst, FalsePositive
from trust_env.agents.attacks.flood import Flood
from trust_env.agents.attacks.followed_targets import Drag, Steal
from trust_env.agents.attacks.local_majority import Collusion, Framing
from trust_env.agents.attacks.outward import Outward
from trust_env.agents.attacks.planner import Planner
from trust_env.agents.attacks.replay import Replay
from trust_env.agents.attacks.shared_false_positives import OptimalFalsePositive
from trust_env.agents.attacks.suppression import SelectiveSuppress, Suppress
from trust_env.agents.attacks.timing import OnOff, Sleeper
from trust_env.agents.attacks.unseen_false_positives import Exclusive, FovAware, Stealth
from trust_env.agents.base import Policy, PolicyLike
from trust_env.agents.learned.policy import Learned
from trust_env.agents.parameters import construct
from trust_env.errors import unknown_name
from trust_env.spec import Spec, load_object, parse
from trust_env.user_code import missing_methods

POLICIES: dict[str, type[Policy]] = {
    "honest": Honest,
    "random": Random,
    "false_positive": FalsePositive,
    "optimal_false_positive": OptimalFalsePositive,
    "outward": Outward,
    "exclusive": Exclusive,
    "stealth": Stealth,
    "by_turns": ByTurns,
    "planner": Planner,
    "fov_aware": FovAware,
    "framing": Framing,
    "collusion": Collusion,
    "burst": Burst,
    "flood": Flood,
    "suppress": Suppress,
    "selective_suppress": SelectiveSuppress,
    "replay": Replay,
    "drag": Drag,
    "steal": Steal,
    "sleeper": Sleeper,
    "on_off": OnOff,
    "learned": Learned,
}


def policies() -> tuple[str, ...]:
    """The names of the built-in policies."""
    return tuple(POLICIES)


def build_policy(policy: Any) -> PolicyLike:
    """A policy from its name (`false_positive(n=2)`, `my_file.py:MyPolicy(x=3)`, `runs/a`, the folder of a
    training run), or an object that is one.

    Raises ValueError for a name that gives no policy, or not with such parameters, TypeError for an object that
    is none.
    """
    built = _build_from_spec(parse_policy(policy)) if isinstance(policy, str) else policy
    fault = missing_methods(built, "reset(context)", "act(observations)")
    if fault:
        error = ValueError if isinstance(policy, str) else TypeError
        raise error(f"a policy is a name, or an object with `reset(context)` and `act(observations)`; {fault}")
    return built


def _build_from_spec(spec: Spec) -> Any:
    if spec.path is None and spec.name not in POLICIES:
        raise unknown_name("policy", spec.name, POLICIES)
    make = POLICIES[spec.name] if spec.path is None else load_object(spec)
    if not callable(make):
        return make
    name = spec.name if spec.path is None else f"{spec.path}:{spec.name}"
    return construct("policy", name, make, spec.params | _inner_policies(make, spec.params))


def _inner_policies(make: Any, params: Mapping[str, Any]) -> dict[str, PolicyLike]:
    """The parameters that are policies themselves, built from what is given or from their defaults."""
    names = getattr(make, "policy_parameters", ())
    defaults = inspect.signature(make).parameters
    return {name: build_policy(params.get(name, defaults[name].default)) for name in names}


def parse_policy(text: str) -> Spec:
    """As `trust_env.spec.parse`, but a training run, `runs/a`, is `learned(path='runs/a')`."""
    if text.strip().startswith("search("):
        raise ValueError(
            f"{text}: a search has to be run before it can be played; expected what `trust-env exploit` or "
            "`training.search` has found, such as false_positive(n=2)"
        )
    return Spec(Learned.name, {"path": text.strip()}) if is_run(text) else parse(text)


def is_run(text: str) -> bool:
    """Whether a text names a training run: a policy file, or a folder and not a policy."""
    text = text.strip()
    if text.endswith(".safetensors"):
        return "(" not in text
    if "(" in text or ".py:" in text or text in POLICIES:
        return False
    return "/" in text or os.sep in text or os.path.isdir(text)
