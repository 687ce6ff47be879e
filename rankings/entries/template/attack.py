"""MyAttack: every adversary injects phantoms at fixed places in its view, and keeps them alive."""

from typing import ClassVar

import numpy as np

from trust_env.agents import Policy, PolicyContext
from trust_env.agents.base import PLACE


class MyAttack(Policy):
    """One sentence on what it does: `trust-env attacks show` prints it.

    n: phantoms of each adversary; where its budget is less, that many.
    start: frames to be honest first.
    """

    name = "MyAttack"
    knowledge = "own"  # own | poses | picture | white_box: the least that `choose` needs to see
    reads: ClassVar = ("pose",)  # fields of the observation that `choose` uses; see docs: what agents observe

    def __init__(self, n: int = 2, start: int = 0):
        if n < 1 or start < 0:
            raise ValueError(f"MyAttack: n = {n}, start = {start}: expected n of at least 1, start of at least 0")
        self.n, self.start = n, start

    def prepare(self, context: PolicyContext) -> None:
        """Allocate: called when the scenario or the number of worlds W is new. n adversaries are played."""
        self.n_slots = min(self.n, context.scenario.injection.slots)
        self.places = np.zeros((len(context.worlds), len(context.agents), self.n_slots, 2))  # m

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """Actions float32[W, n, A] from what is seen, in metres: pose[W, n, 4] is x, y, cos and sin of the heading."""
        begins = np.flatnonzero(self.frame == 0)
        if len(begins):
            draws = self.draw(PLACE, 3 * self.n_slots, begins).reshape(len(begins), -1, self.n_slots, 3)
            self.places[begins] = self.fovs.sample(seen["pose"][begins], draws)
        fire = np.broadcast_to((self.frame >= self.start)[:, None, None], self.places.shape[:-1])
        return self.encode(seen["pose"], self.places, fire)
