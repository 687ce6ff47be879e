"""`oracle` and `blank`: two references to compare defenses with, for evaluation only."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from trust_env.compiled.kernels import kernel
from trust_env.defenses.base import BuiltIn
from trust_env.defenses.checks import choice, number
from trust_env.defenses.looks import believe, forget_all, looks_at
from trust_env.world.agents import ROLES
from trust_env.world.tracking.track_store import list_confirmed

_LONE = ("hide", "show")
_HIDE = _LONE.index("hide")
_MOST = 5.0  # nats, of a track's log-odds
_ADVERSARY = ROLES["adversary"]


class Oracle(BuiltIn):
    """A reference that knows the roles, and judges tracks by what the benign agents see; for evaluation only.

    A track's log-odds L gain ln(P_D/ε) at a hit and ln((1-P_D)/(1-ε)) at a miss of each benign agent that looks
    at it, within ±5; its trust is 1/(1 + e^-L). An agent's trust is 1 or 0, by its role.

    lone: what becomes of tracks at which no benign agent has ever looked, "hide" or "show"; epsilon: the rate of
    hits on what is no target, in (0, 1). Raises ValueError for anything else.
    """

    reference: ClassVar = True
    parameters: ClassVar = {"lone": "i8", "epsilon": "f8"}
    memory: ClassVar = {
        "track_id": "i8 J",
        "log_odds": "f8 J | nats",
        "watched": "b1 J | a benign agent has looked at the track",
    }

    def __init__(self, lone: str = "hide", epsilon: float = 0.02):
        self.lone, self._lone = lone, choice("oracle", "lone", lone, _LONE)
        self.epsilon = number("oracle", "epsilon", epsilon, 0.0, 1.0, "()")

    def params(self) -> dict[str, Any]:
        return {"lone": self.lone, "epsilon": self.epsilon}

    def values(self, n_agents: int) -> dict[str, Any]:
        return {"lone": self._lone, "epsilon": self.epsilon}

    @staticmethod
    @kernel
    def reset(world):
        """No track is known."""
        forget_all(world.oracle)

    @staticmethod
    @kernel
    def judge(world):
        """Tracks by the looks of benign agents, agents by their roles."""
        for c in range(list_confirmed(world)):
            j = world.scratch.listing[c]
            _weigh_looks(world, j)
            hidden = not world.oracle.watched[j] and world.oracle.lone == _HIDE
            believe(world, j, 0.0 if hidden else 1.0 / (1.0 + math.exp(-world.oracle.log_odds[j])))
        for k in range(world.agents.role.shape[0]):
            world.verdict.agent_trust[k] = 0.0 if world.agents.role[k] == _ADVERSARY else 1.0
            world.verdict.agent_trust_var[k] = 0.0


@kernel
def _weigh_looks(world, j):
    """L of a track, after this frame."""
    memory, evidence, epsilon = world.oracle, world.evidence, world.oracle.epsilon
    if memory.track_id[j] != world.tracks.id[j]:
        memory.track_id[j], memory.log_odds[j], memory.watched[j] = world.tracks.id[j], 0.0, False
    total = memory.log_odds[j]
    for k in range(world.agents.role.shape[0]):
        if world.agents.role[k] != _ADVERSARY and looks_at(world, k, j):
            p = world.agents.believed_p_detect[k]
            total += math.log(p / epsilon) if evidence.hit[k, j] else math.log((1.0 - p) / (1.0 - epsilon))
            memory.watched[j] = True
    memory.log_odds[j] = min(max(total, -_MOST), _MOST)


class Blank(BuiltIn):
    """A reference that shows nothing: what missing every target costs; for evaluation only."""

    reference: ClassVar = True

    @staticmethod
    @kernel
    def judge(world):
        """No track is fit for the picture."""
        for j in range(world.tracks.count):
            world.verdict.publish[j] = False
