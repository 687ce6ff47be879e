"""False negatives: an agent keeps silent about targets that it sees."""

from __future__ import annotations

import numpy as np

from trust_env.agents.attacks.detection_tracker import Follower
from trust_env.agents.base import CHOOSE, Policy, PolicyContext
from trust_env.agents.parameters import one_of, share, whole

CHOICES = ("random", "nearest", "all")


class Suppress(Policy):
    """Drops the own detections of chosen targets, and follows them, so that they are the same in every frame.

    choice       random: every target that comes into sight is chosen with probability `fraction` |
                 nearest: the nearest, until `fraction` of the targets in sight (rounded up) are chosen |
                 all: every detection
    fraction     share of the targets, above 0 and at most 1
    start        frames to be honest first
    """

    name = "suppress"

    def __init__(self, fraction: float = 0.5, choice: str = "random", start: int = 0):
        self.fraction = share(self.name, "fraction", fraction)
        self.choice = one_of(self.name, "choice", choice, CHOICES)
        self.start = whole(self.name, "start", start, 0)

    def prepare(self, context: PolicyContext) -> None:
        self.targets = Follower(context.scenario, context.agents, len(context.worlds))

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        mask = seen["detections_mask"]
        suppress = mask if self.choice == "all" else self._chosen(seen["detections"], mask)
        return self.encode(seen["pose"], suppress=suppress & self._attacking())

    def _attacking(self) -> np.ndarray:
        return (self.frame >= self.start)[:, None, None]

    def _chosen(self, points: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Which detections bool[W, n, D] are of chosen targets."""
        self.targets.forget(self.frame == 0)
        slot, new = self.targets.follow(points, mask)
        chosen = mask & np.take_along_axis(self.targets.chosen, np.maximum(slot, 0), axis=-1)
        if self.choice == "nearest":
            chosen |= self._nearest(mask & ~chosen & self._attacking())
        elif new.any():
            chosen |= new & (self.draw(CHOOSE, mask.shape[-1]) < self.fraction)
        w, n, d = np.nonzero(chosen)
        self.targets.chosen[w, n, slot[w, n, d]] = True
        return chosen

    def _nearest(self, others: np.ndarray) -> np.ndarray:
        """Of the others the first, which are the nearest: as many as the share still lacks."""
        followed = self.targets.alive.sum(axis=-1)
        already = (self.targets.alive & self.targets.chosen).sum(axis=-1)
        lacking = np.ceil(self.fraction * followed - 1e-9) - already
        return others & (np.cumsum(others, axis=-1) <= lacking[..., None])
