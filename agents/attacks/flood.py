"""As many detections as a frame holds."""

from __future__ import annotations

from typing import Any

import numpy as np

from trust_env.agents.base import PLACE, Policy, PolicyContext
from trust_env.agents.parameters import true_or_false, whole_number
from trust_env.agents.search_ranges import SearchRanges, start_range
from trust_env.scenario import Scenario


class Flood(Policy):
    """Fills all slots in every frame: with detections all over the own FOV, or with all of them at one place.

    Spread out they start tracks everywhere and fall into the gates of true ones. Stacked, each starts a track of
    its own, unless the centre knows that the sensor cannot resolve them (`sensor.resolution`).

    stack        False: at new random places in every frame | True: all at one place, which stays
    start        frames to be honest first
    """

    name = "flood"
    reads = ("pose",)

    def __init__(self, stack: bool = False, start: int = 0):
        self.stack = true_or_false(self.name, "stack", stack)
        self.start = whole_number(self.name, "start", start, 0)

    @classmethod
    def search_ranges(cls, scenario: Scenario, **given: Any) -> SearchRanges:
        return {"stack": (False, True), "start": start_range(scenario)}

    def prepare(self, context: PolicyContext) -> None:
        slots = context.scenario.injection.slots
        self.position = np.zeros((len(context.worlds), len(context.agents), slots, 2))  # m

    def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        worlds, agents, slots, _ = self.position.shape
        if not self.stack:
            draws = self.draw(PLACE, 3 * slots).reshape(worlds, agents, slots, 3)
            self.position = self.fovs.sample(seen["pose"], draws)
        elif slots and (self.frame == 0).any():
            draws = self.draw(PLACE, 3)[:, :, None]
            place = self.fovs.sample(seen["pose"], draws)
            self.position = np.where((self.frame == 0)[:, None, None, None], place, self.position)
        fire = np.broadcast_to((self.frame >= self.start)[:, None, None], (worlds, agents, slots))
        return self.encode(seen["pose"], self.position, fire)
