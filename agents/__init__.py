"""Policies: what chooses the agents' actions. One file per family in `attacks/`, their names in `registry`.

An attack is a policy of adversaries; `honest` is the control. A policy of your own is a class with a method
`choose` (see `Policy`), in a file of yours: `build_policy("my_file.py:MyPolicy(x=3)")`. A trained one is the
folder of its run: `build_policy("runs/a")`.
"""

if __name__ != "trust_env.agents":  # in the repository this folder could be imported a second time
    raise ImportError("this is trust_env.agents: import it by that name")

from trust_env.agents.base import Policy, PolicyContext, PolicyLike
from trust_env.agents.knowledge import check_knowledge, knowledge_of, name_of, sufficient_knowledge
from trust_env.agents.player import Player
from trust_env.agents.registry import POLICIES, build_policy, is_run, parse_policy, policies

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
