"""Whether agents observe enough for a policy: the knowledge levels of policies and scenarios compared."""

from __future__ import annotations

from typing import Any

from trust_env.scenario import Scenario
from trust_env.spaces.observation import KNOWLEDGE


def check_knowledge(policy: Any, scenario: Scenario) -> None:
    """ValueError, naming both levels, if the scenario lets agents observe less than the policy needs."""
    needed = knowledge_of(policy)
    if KNOWLEDGE[scenario.knowledge] < KNOWLEDGE[needed]:
        raise ValueError(
            f"policy {name_of(policy)!r} needs knowledge level {needed!r}, but scenario {scenario.name!r} "
            f"gives {scenario.knowledge!r}; give more with '{scenario.name}(knowledge={needed})'"
        )


def sufficient_knowledge(scenario: Scenario, *policies: Any) -> str:
    """The least knowledge level, from the scenario's own on, at which all the policies can play."""
    levels = [scenario.knowledge, *(knowledge_of(policy) for policy in policies)]
    return max(levels, key=KNOWLEDGE.__getitem__)


def knowledge_of(policy: Any) -> str:
    """The least knowledge level that a policy, or a class of policies, needs."""
    level = getattr(policy, "knowledge", "own")
    if level not in KNOWLEDGE:
        known = ", ".join(KNOWLEDGE)
        raise ValueError(f"policy {name_of(policy)!r}: knowledge = {level!r}: expected one of {known}")
    return level


def name_of(policy: Any) -> str:
    """The policy's `name`, else that of its class."""
    return getattr(policy, "name", None) or type(policy).__name__
