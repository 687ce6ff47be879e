"""False negatives: an agent does not report targets that it sees, chosen ones or where it is in the majority."""

from __future__ import annotations

from typing import Any

import numpy as np

from trust_env.agents.attacks.detection_tracker import DetectionTracker
from trust_env.agents.base import CHOOSE, Policy, PolicyContext
from trust_env.agents.parameters import fraction as valid_fraction
from trust_env.agents.parameters import one_of, whole_number
from trust_env.agents.search_ranges import Range, SearchRanges, start_range
from trust_env.agents.witnesses import Witnesses
from trust_env.scenario import Scenario

CHOICES = ("random", "nearest", "all")


class Suppress(Policy):
    """Suppresses the own detections of chosen targets, which it tracks, so that they stay the same targets.

    Where the scenario lists suppressions, those of the own agents are replayed, and choice and fraction do
    not apply: an agent knows its targets by where they start, and where their velocities would have taken them.

    choice       random: every target that comes into sight is chosen with probability `fraction` |
                 nearest: the nearest, until `fraction` of the targets in sight (rounded up) are chosen |
                 all: every detection
    fraction     fraction of the targets, above 0 and at most 1
    start        frames to be honest first
    """

    name = "suppress"
    reads = ("pose", "detections", "detections_mask")

    def __init__(self, fraction: float = 0.5, choice: str = "random", start: int = 0):
        self.fraction = valid_fraction(self.name, "fraction", fraction)
        self.choice = one_of(self.name, "choice", choice, CHOICES)
        self.start = whole_number(self.name, "start", start, 0)

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        return {"fraction": Range(0.05, 1.0), "choice": CHOICES, "start": start_range(scenario)}

    def prepare(self, context: PolicyContext) -> None:
        self.targets = DetectionTracker(context.scenario, context.agents, len(context.worlds))
        self._replays = bool(context.scenario.suppressions)
        self._origin, self._velocity = _listed_targets(context)

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        mask = seen["detections_mask"]
        everything = self.choice == "all" and not self._replays
        suppress = mask if everything else self._chosen(seen["detections"], mask)
        return self.encode(seen["pose"], suppress=suppress & self._active())

    def _active(self) -> np.ndarray:
        """In which worlds it suppresses at all in the present frame, bool[W, 1, 1]."""
        return (self.frame >= self.start)[:, None, None]

    def _chosen(self, points: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Which detections bool[W, n, D] are of chosen targets."""
        self.targets.clear(self.frame == 0)
        slot, new = self.targets.update(points, mask)
        chosen = mask & np.take_along_axis(self.targets.chosen, np.maximum(slot, 0), axis=-1)
        if self._replays:
            chosen |= new & self._listed(points)
        elif self.choice == "nearest":
            chosen |= self._nearest(mask & ~chosen & self._active())
        elif new.any():
            chosen |= new & (self.draw(CHOOSE, mask.shape[-1]) < self.fraction)
        w, n, d = np.nonzero(chosen)
        self.targets.chosen[w, n, slot[w, n, d]] = True
        return chosen

    def _listed(self, points: np.ndarray) -> np.ndarray:
        """Which detections bool[W, n, D] lie where a target is that the scenario lists for the agent."""
        moved = (self.dt * self.frame)[:, None, None, None] * self._velocity
        offset = points[:, :, :, None] - (self._origin + moved)[:, :, None]  # [W, n, D, S, 2]
        distance = np.hypot(offset[..., 0], offset[..., 1])
        return np.any(distance < self.context.scenario.metrics.match_distance, axis=-1)

    def _nearest(self, others: np.ndarray) -> np.ndarray:
        """The nearest (the first) of the others: as many as the fraction still lacks."""
        tracked = self.targets.alive.sum(axis=-1)
        chosen = (self.targets.alive & self.targets.chosen).sum(axis=-1)
        lacking = np.ceil(self.fraction * tracked - 1e-9) - chosen
        return others & (np.cumsum(others, axis=-1) <= lacking[..., None])


class SelectiveSuppress(Policy):
    """Suppresses own detections only where adversaries outnumber the honest agents that look there.

    The majority does not see the target: its track is distrusted, and the honest agent that reports it accused.

    margin       adversaries that look at the place, less honest agents that do, at least
    start        frames to be honest first
    """

    name = "selective_suppress"
    knowledge = "poses"
    reads = ("pose", "detections", "detections_mask", "poses")

    def __init__(self, margin: int = 1, start: int = 0):
        self.margin = whole_number(self.name, "margin", margin, 1)
        self.start = whole_number(self.name, "start", start, 0)

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        adversaries = max(1, scenario.roles.count("adversary"))
        return {"margin": Range(1, adversaries, whole=True), "start": start_range(scenario)}

    def prepare(self, context: PolicyContext) -> None:
        self.witnesses = Witnesses(context)

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        points, mask = seen["detections"], seen["detections_mask"]
        flat = points.reshape(len(points), 1, -1, 2)
        adversaries = self.fovs.contains(seen["pose"], flat).sum(axis=1).reshape(mask.shape)
        honest = self.witnesses.see(seen, points).sum(axis=1)
        active = (self.frame >= self.start)[:, None, None]
        return self.encode(seen["pose"], suppress=mask & active & (adversaries - honest >= self.margin))


def _listed_targets(context: PolicyContext) -> tuple[np.ndarray, np.ndarray]:
    """Start [n, S, 2] (m) and velocity [n, S, 2] (m/s) of the targets that the scenario lists for each agent.

    NaN where an agent has fewer; a velocity that the scenario draws counts as none.
    """
    targets = context.scenario.targets
    positions = np.array(targets.positions or ()).reshape(-1, 2)
    velocities = np.zeros_like(positions) if targets.velocities is None else np.array(targets.velocities)
    listed = [[s.target for s in context.scenario.suppressions if s.agent == k] for k in context.agents]
    start = np.full((len(listed), max(map(len, listed), default=0), 2), np.nan)
    velocity = np.zeros_like(start)
    for i, own in enumerate(listed):
        start[i, : len(own)], velocity[i, : len(own)] = positions[own], velocities[own]
    return start, velocity
