"""Copies of the worlds that a policy plays in, to try actions in; what its agents cannot know is not in them.

The copies hold what the fusion centre works with: poses, tracks, evidence, verdict, and the memory of the defense, of
which `white_box` shows scores and trusts. They do not hold the truth, nor what agents outside the coalition have
sensed for the coming frame or reported in the last one, nor the random numbers to come: targets are those that the
policy imagines, the others sense these, and all numbers are drawn under other seeds.
"""

from __future__ import annotations

import copy
from functools import cached_property

import numpy as np

from trust_env.batch import Batch
from trust_env.compiled.layout import GROUPS, ROW
from trust_env.defenses import BuiltIn
from trust_env.parameters import name_of
from trust_env.world.origin import CLUTTER
from trust_env.world.targets import DRAWN, RECORDED

# The groups of fields that copies take over, beside the memory of a built-in defense.
KNOWN = ("clock", "verdict", "agents", "tracks", "local_tracks", "evidence", "picture", "retro")
SEED = "seed"  # of the clock, and yet hidden
OTHER_SEEDS = 0x2545F4914F6CDD1D  # joined to the worlds' seeds in their copies, with the number of the sample


class CopiedWorlds:
    """The worlds of a batch as a coalition may know them, played on under the same defense.

        copies.prepare(agents, targets, present)       # once in a frame, for every sample of what is not known
        copies.restore()                               # as often as wanted
        copies.step(actions)

    What happens in a copy depends on its own world only.
    """

    def __init__(self, worlds: Batch):
        self._worlds = worlds
        self._prepared = np.empty(0, dtype=np.uint8)

    @cached_property
    def copies(self) -> Batch:
        """The worlds that are played in, made when they are first needed."""
        w = self._worlds
        copies = Batch(w.scenario, copy.deepcopy(w.defense), w.num_worlds, w.horizon, w.threads)
        if copies.parameters["target_source"] == RECORDED:
            copies.parameters.set(target_source=DRAWN)  # the record says where targets will be
        return copies

    @cached_property
    def known_fields(self) -> list[str]:
        """The names of the fields that are taken over as they are."""
        defense = self._worlds.defense
        groups = (*KNOWN, name_of(defense)) if isinstance(defense, BuiltIn) else KNOWN
        fields = [field for group in groups for field in GROUPS[group].values() if field.buffer == ROW]
        return [field.name for field in fields if field.name != SEED]

    def prepare(self, agents: np.ndarray, targets: np.ndarray, present: np.ndarray, sample: int = 0) -> None:
        """Imagine the present frame: the coalition of `agents` knows its own detections, all others sense
        targets[W, n, 4] (m, m/s) where present[W, n], as many as the scenario has room for.
        """
        now, then = self._worlds.arrays, self.copies.arrays
        self.copies.rows[...] = 0
        for name in self.known_fields:
            then[name][...] = now[name]
        then.retro_kept_origin[...] = CLUTTER
        then.seed[...] = now.seed ^ (OTHER_SEEDS + sample)
        self._place_targets(targets, present)
        with self.copies.use:
            self.copies.sense()
            self.copies.use.unfinished = False
        for name in ("raw_count", "raw_detections"):
            then[name][:, agents] = now[name][:, agents]
        then.raw_origin[:, agents] = CLUTTER
        self._prepared = self.copies.rows.copy()

    def _place_targets(self, targets: np.ndarray, present: np.ndarray) -> None:
        """The first targets that are present, as many as there are slots."""
        alive, state = self.copies.arrays.target_alive, self.copies.arrays.target_state
        first = np.argsort(~present, axis=1, kind="stable")[:, : alive.shape[1]]
        alive[:, : first.shape[1]] = np.take_along_axis(present, first, axis=1)
        state[:, : first.shape[1]] = np.take_along_axis(targets, first[..., None], axis=1)

    def restore(self) -> None:
        """Go back to what was prepared."""
        self.copies.rows[...] = self._prepared
        own = self._worlds.own_defense
        if own is not None:
            self.copies.own_defense = copy.deepcopy(own)

    def step(self, actions: np.ndarray) -> np.ndarray:
        """One frame on actions[W, K, A]; returns the observations float32[W, K, O] of the next."""
        with self.copies.use:
            self.copies.step(actions)
            self.copies.use.unfinished = False
        return self.copies.arrays.observation.copy()

    def damage(self) -> np.ndarray:
        """False tracks and missing targets of the last frame, with the imagined targets as the truth, [W]."""
        return self.copies.arrays.false_tracks + self.copies.arrays.missing_targets
