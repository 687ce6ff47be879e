"""`rfsn_beta`: Beta trust in agents, judged against the trust-weighted vote of the others."""

from __future__ import annotations

from typing import Any, ClassVar

from trust_env.compiled.kernels import kernel
from trust_env.defenses.base import BuiltIn
from trust_env.defenses.checks import number, whole
from trust_env.defenses.looks import VOTES, believe_agent, count_agreements, judge_by_votes, reset_votes
from trust_env.world.tracking.track_store import list_confirmed


class RfsnBeta(BuiltIn):
    """Beta trust that ages, from agreement with the trust-weighted vote of the others (after Ganeriwal et al. 2008).

    Each frame α ← wα + r and β ← wβ + s, r and s the looks at which the agent agreed, and did not, with the vote
    of the other agents that look at the same track, weighted by their trust of the frame before; ties, and looks
    of one agent alone, do not count. An agent's trust is (α + 1) / (α + β + 2). A track's trust is a moving
    average, over `window` frames with at least two lookers, of the share of hits, weighted by trust.

    w: ageing, in (0, 1]; window: frames, from 1 to 1000. Raises ValueError outside these ranges. After Ganeriwal,
    Balzano & Srivastava, "Reputation-based framework for high integrity sensor networks", ACM TOSN 4(3), 2008.
    """

    parameters: ClassVar = {"w": "f8", "window": "i8 | frames"}
    memory: ClassVar = {**VOTES, "belief": "f8 K 2 | α, β"}

    def __init__(self, w: float = 0.98, window: int = 10):
        self.w = number("rfsn_beta", "w", w, 0.0, 1.0, "(]")
        self.window = whole("rfsn_beta", "window", window, 1, 1000)

    def params(self) -> dict[str, Any]:
        return {"w": self.w, "window": self.window}

    def values(self, n_agents: int) -> dict[str, Any]:
        return self.params()

    @staticmethod
    @kernel
    def reset(world):
        """Nothing counted: a trust of one half in all."""
        reset_votes(world.rfsn_beta, 0.5)
        for k in range(world.rfsn_beta.belief.shape[0]):
            world.rfsn_beta.belief[k, 0], world.rfsn_beta.belief[k, 1] = 0.0, 0.0

    @staticmethod
    @kernel
    def judge(world):
        """Agents by the trust of the frame before, then tracks by the new one."""
        memory, listed = world.rfsn_beta, list_confirmed(world)
        count_agreements(world, memory, listed)
        for k in range(memory.belief.shape[0]):
            for side in range(2):
                memory.belief[k, side] = memory.w * memory.belief[k, side] + memory.agreement[k, side]
            memory.weight[k] = believe_agent(world, k, memory.belief[k, 0] + 1.0, memory.belief[k, 1] + 1.0)
        judge_by_votes(world, memory, listed, memory.window)
