"""MyDefense: trust in a track is how many of the agents that should have seen it did, over the last frames."""

import numpy as np

from trust_env import Evidence, Shape, Verdict


class MyDefense:
    """One sentence on what it does: `trust-env defenses show` prints it.

    window: frames that trust looks back on.
    """

    def __init__(self, window: int = 9):
        if window < 1:
            raise ValueError(f"MyDefense: window = {window}: expected a whole number of at least 1")
        self.window = window

    def reset(self, shape: Shape, worlds: np.ndarray) -> None:
        """Begin an episode where worlds[W] is true. shape.W worlds, shape.K agents, shape.J columns of tracks."""
        if worlds.all():
            self.trust = np.full((shape.W, shape.J), 0.5)
            self.seen_as = np.full((shape.W, shape.J), -1)  # id of the track that each column holds
        self.trust[worlds], self.seen_as[worlds] = 0.5, -1

    def update(self, evidence: Evidence) -> Verdict:
        """The verdict on a frame. A track is shown when its trust is at least 0.5; NaN: no opinion."""
        expected, detected = evidence.expected, evidence.detected  # bool[W, K, J]
        seen = (expected & detected).sum(1) / np.maximum(expected.sum(1), 1)  # [W, J]
        new = evidence.track_id != self.seen_as
        self.trust[new], self.seen_as = 0.5, evidence.track_id.copy()
        self.trust += (seen - self.trust) / self.window
        agreement = (expected & (detected == (self.trust > 0.5)[:, None])).sum(2)
        looks = expected.sum(2)
        agents = np.where(looks > 0, agreement / np.maximum(looks, 1), np.nan)  # [W, K]
        return Verdict(track_trust=self.trust.copy(), agent_trust=agents)
