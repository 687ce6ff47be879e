"""Phantoms as views keep them: places that are pointed to, and reported frame after frame.

A place is a complex number, x + iy.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from agents.geometry import Fovs
from agents.parameters import length_or_none, one_of, refuse, whole_or_none
from agents.policy import PolicyContext
from agents.views.view import View
from trust_env.action import action_table
from trust_env.observation import REACH
from trust_env.scenario import Scenario

Places: TypeAlias = np.ndarray[tuple[int, ...], np.dtype[np.complex64]]

AREA, OUTWARD = FRAMES = ("area", "outward")
PAIRS = frozenset(  # fields that are made of pairs: x and y, vx and vy, cos and sin
    ["pose", "detections", "poses", "picture", "tracks", "shared_detections", "shared_reports"]
)
_TINY = np.float32(1e-30)  # no division by 0 where phantoms stay
MOST_TURNS = 2  # phantoms that share a slot: tracks outlive a frame without a report, not two while tentative
PATIENCE = 5  # frames in a row without a report after which a phantom is gone; the tracker drops it then too


class PlacedPhantoms(View):
    """A phantom appears where the learner points, and afterwards follows at `speed`: reported wherever it is,
    so that the noise of exploration does not tear its track apart.

    A learner sees, of every phantom, its place relative to the agent (as detections are scaled) and how
    present it is: 1 reported, then less from frame to frame, 0 gone.
    """

    hidden = frozenset({"role", "report", "report_mask"})  # the view's own state says it shorter
    remembered = ("place", "silent", "clock")

    place: Places  # complex64[W, n, P], x + iy relative to the agent, in REACH radii of its FOV
    silent: np.ndarray  # int8[W, n, P], frames in a row without a report, up to PATIENCE: there is none
    clock: np.ndarray  # int64[W], frames since the episode began

    def __init__(self, n: int | None, speed: float | None, frame: str, knowledge: str | None):
        super().__init__(knowledge)
        self.frame = one_of(self.name, "frame", frame, FRAMES)
        self.n = whole_or_none(self.name, "n", n, 1, "the largest injection budget")
        self.speed = length_or_none(self.name, "speed", speed, "m/s", "as the slowest targets")

    def prepare(self, context: PolicyContext) -> int:
        table, learners = action_table(context.scenario), context.agents
        self._injections, self._suppressions = table["injections"], table["suppressions"]
        self._detections = context.observation_table["detections"].slice
        self.phantoms, self._slots = self._count(context)
        self._turns = -(-self.phantoms // max(self._slots, 1))
        shape = (len(context.worlds), len(learners), self.phantoms)
        self.clock = np.zeros(shape[0], dtype=np.int64)
        self.place, self.silent = np.zeros(shape, np.complex64), np.full(shape, PATIENCE, np.int8)
        reach = context.observation_table.scales.reach[learners]
        self._fovs, self._reach = Fovs.of(context.scenario, learners), reach[:, None]
        self._pose = context.observation_table["pose"].slice
        self._angular = any(context.scenario.agent(int(k)).fov.type != "circle" for k in learners)
        self._turn = np.ones((1, 1, 1), dtype=np.complex64)
        self._pairs, start = [], 0
        for name, length in self.fields.items():
            if name in PAIRS:
                self._pairs.append(slice(start, start + length))
            start += length
        self._face(np.tile([0.0, 0.0, 1.0, 0.0], (len(learners), 1)))
        self._step = (self._metres_per_frame(context.scenario) / reach).astype(np.float32)[:, None]
        return 3 * self.phantoms

    def _count(self, context: PolicyContext) -> tuple[int, int]:
        """Phantoms per learner, and the slots that they share."""
        budgets = [context.scenario.agent(int(k)).budget.injections for k in context.agents]
        slots = min(max(budgets), context.scenario.injection.slots)
        n = slots if self.n is None else self.n
        if n > MOST_TURNS * slots:
            most = f"at most {MOST_TURNS * slots}, {MOST_TURNS} by turns in each of {slots} injection slots"
            raise refuse(self.name, "n", n, f"{most} of scenario {context.scenario.name!r}")
        return n, slots

    def _metres_per_frame(self, scenario: Scenario) -> float:
        if self.speed is not None:
            return self.speed * scenario.dt
        if scenario.targets.data is None:
            return scenario.targets.speed[0] * scenario.dt
        return math.sqrt(scenario.tracker.initial_velocity_variance) * scenario.dt

    def begin(self, mask: np.ndarray) -> None:
        self.place[mask], self.silent[mask], self.clock[mask] = 0.0, PATIENCE, 0

    def observe(self, observations: np.ndarray) -> np.ndarray:
        seen = super().observe(observations)
        if self.frame == OUTWARD:
            back = np.conj(self._outward(observations))
            for stretch in self._pairs:
                seen[..., stretch].view(np.complex64)[...] *= back
            np.clip(seen, -1.0, 1.0, out=seen)
        return seen

    def look(self, observations: np.ndarray) -> None:
        """How the learners stand, on observations[W, n, O]."""
        if self.frame == OUTWARD:
            self._turn = self._outward(observations)
        if self._angular:
            self._face(observations[..., self._pose] * np.array([0.0, 0.0, 1.0, 1.0]))

    def _outward(self, observations: np.ndarray) -> Places:
        """The direction [W, n, 1] from the middle of the area to the learner, of length 1."""
        pose = observations[..., self._pose]
        way = pose[..., 0:1] + 1j * pose[..., 1:2]
        length = np.abs(way)
        return np.where(length > 0.0, way / np.maximum(length, _TINY), np.complex64(1.0))

    def _face(self, pose: np.ndarray) -> None:
        """Middle and half size complex64[..., n, 1] of the FOVs' boxes at pose[..., n, 4], in REACH radii."""
        box = self._fovs.boxes(pose) / self._reach
        low, high = box[..., 0] + 1j * box[..., 2], box[..., 1] + 1j * box[..., 3]
        self._middle: Places = ((low + high) / 2).astype(np.complex64)[..., None]
        self._half: Places = ((high - low) / 2).astype(np.complex64)[..., None]

    def over_fov(self, x: np.ndarray, y: np.ndarray) -> Places:
        """Places complex64[W, n, P] for x and y in radii of the FOV, none beyond it."""
        place: Places = np.empty(x.shape, dtype=np.complex64)
        place.real, place.imag = x, y
        place /= np.float32(REACH) * np.maximum(np.float32(1.0), np.abs(place))
        return place

    def move(self, pointed: Places, reported: np.ndarray) -> None:
        """A frame on: at most a step toward pointed[W, n, P]; those that are gone appear there."""
        way = pointed - self.place
        share = self._step / np.maximum(np.abs(way), np.maximum(self._step, _TINY))
        share[self.silent == PATIENCE] = 1.0
        self.place += share * way
        silent = np.where(reported, np.int8(0), np.minimum(self.silent + np.int8(1), PATIENCE))
        self.silent[...] = np.where(self._due(), silent, self.silent)

    def _due(self) -> np.ndarray:
        """Which phantoms have their turn in the present frame, bool[W, 1, P]."""
        turn = np.arange(self.phantoms) // max(self._slots, 1)
        return (turn == (self.clock % self._turns)[:, None])[:, None]

    def actions(self, suppress: np.ndarray) -> np.ndarray:
        """Raw actions float32[W, n, A]: the phantoms whose turn it is and that are not silent, and
        suppress[W, n, D].
        """
        w, n, phantoms = self.silent.shape
        place, slots = self.place * self._turn, np.zeros((w, n, self._turns * self._slots, 3), np.float32)
        slots[..., :phantoms, 0] = self.silent == 0
        slots[..., :phantoms, 1] = (place.real - self._middle.real) / self._half.real
        slots[..., :phantoms, 2] = (place.imag - self._middle.imag) / self._half.imag
        out = np.zeros((w, n, self._action_size), dtype=np.float32)
        by_turn = slots.reshape(w, n, self._turns, -1)
        out[..., : by_turn.shape[-1]] = by_turn[np.arange(w), :, self.clock % self._turns]
        np.clip(out, -1.0, 1.0, out=out)
        out[..., self._suppressions] = suppress
        self.clock += 1
        return out

    def detections(self, observations: np.ndarray) -> Places:
        """Places complex64[W, n, D] of the own detections; 0 where there is none."""
        return np.ascontiguousarray(observations[..., self._detections]).view(np.complex64) * np.conj(
            self._turn
        )

    def remember(self, out: np.ndarray) -> None:
        there = self.silent < PATIENCE
        out[..., 0::3] = self.place.real * there
        out[..., 1::3] = self.place.imag * there
        out[..., 2::3] = np.float32(1.0) - self.silent * np.float32(1.0 / PATIENCE)
