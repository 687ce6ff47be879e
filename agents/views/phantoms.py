"""Phantoms that stay: the learner points to places, and the view reports there frame after frame."""

from __future__ import annotations

import math

import numpy as np
from gymnasium.spaces import Box

from agents.geometry import Fovs
from agents.parameters import length_or_none, refuse, whole_or_none
from agents.policy import PolicyContext
from agents.views.view import View
from trust_env.action import action_table
from trust_env.observation import REACH
from trust_env.scenario import Scenario

WITHDRAWN = -0.5  # a phantom is not reported where `report` is below: rarely, when actions are drawn
PATIENCE = 5  # frames in a row without a report after which a phantom is gone; the tracker drops it then too
WIDEST = 2.0  # radius of the suppression disc at +1, in units of REACH radii of the FOV: it covers all


class Phantoms(View):
    """`Box(-1, 1, (3P + 3,))`: per phantom [report, x, y], then the suppression disc [x, y, radius].

    x and y point to a place over the bounding box of the own FOV, as raw actions do. A phantom appears
    where they point, and afterwards follows them at `speed`: reported wherever it is, in every frame, so that
    the noise of exploration does not tear its track apart. While `report` < -0.5 it is not reported; after
    five such frames in a row it is gone, and a new one may appear. Own detections inside the disc are
    suppressed; its radius goes from 0 at -1 over a third of the FOV's at 0 to all of the FOV at +1.

    A learner also sees, of every phantom, its place relative to the agent (as detections are scaled) and how
    present it is: 1 reported, then less from frame to frame, 0 gone.

    n            phantoms per learner; None: the largest injection budget
    speed        m/s, 0: they stay where they appear; None: as the slowest targets
    knowledge    level whose fields a learner sees; None: the scenario's
    """

    name = "phantoms"
    hidden = frozenset({"role", "report", "report_mask"})  # the view's own state says it shorter
    remembered = ("place", "silent")

    place: np.ndarray  # float32[W, n, P, 2], relative to the agent, in units of REACH radii of its FOV
    silent: np.ndarray  # int8[W, n, P], frames in a row without a report, up to PATIENCE: there is none

    def __init__(self, n: int | None = None, speed: float | None = None, knowledge: str | None = None):
        super().__init__(knowledge)
        self.n = whole_or_none(self.name, "n", n, 1, "the largest injection budget")
        self.speed = length_or_none(self.name, "speed", speed, "m/s", "as the slowest targets")

    def prepare(self, context: PolicyContext) -> int:
        table, learners = action_table(context.scenario), context.agents
        self._injections, self._suppressions = table["injections"], table["suppressions"]
        self._detections = context.observation_table["detections"].slice
        phantoms = _count(self.n, context)
        shape = (len(context.worlds), len(learners), phantoms)
        self.place, self.silent = np.zeros((*shape, 2), np.float32), np.full(shape, PATIENCE, np.int8)
        self.action_space = Box(-1.0, 1.0, (3 * phantoms + 3,), np.float32)
        reach = context.observation_table.scales.reach[learners]
        self._middle, self._half = _boxes(context, reach)
        self._step = (self._metres_per_frame(context.scenario) / reach).astype(np.float32)[:, None]
        return 3 * phantoms

    def _metres_per_frame(self, scenario: Scenario) -> float:
        if self.speed is not None:
            return self.speed * scenario.dt
        if scenario.targets.data is None:
            return scenario.targets.speed[0] * scenario.dt
        return math.sqrt(scenario.tracker.initial_velocity_variance) * scenario.dt

    def begin(self, mask: np.ndarray) -> None:
        self.place[mask], self.silent[mask] = 0.0, PATIENCE

    def act(self, choices: np.ndarray, observations: np.ndarray) -> np.ndarray:
        w, n, phantoms = self.silent.shape
        choices = np.asarray(choices, dtype=np.float32)
        pointed = choices[..., : 3 * phantoms].reshape(w, n, phantoms, 3)
        reported = pointed[..., 0] >= WITHDRAWN
        self._move(self._over_fov(pointed[..., 1:]))
        self.silent = np.where(reported, np.int8(0), np.minimum(self.silent + np.int8(1), PATIENCE))
        actions = np.zeros((w, n, self._action_size), dtype=np.float32)
        slots = actions[..., : 3 * phantoms].reshape(w, n, phantoms, 3)
        slots[..., 0] = reported
        slots[..., 1:] = (self.place - self._middle) / self._half
        actions[..., : 3 * phantoms] = slots.reshape(w, n, -1)
        actions[..., self._suppressions] = self._covered(choices[..., 3 * phantoms :], observations)
        return actions

    def _over_fov(self, choices: np.ndarray) -> np.ndarray:
        """Places [W, n, P, 2] in REACH radii for choices in [-1, 1], none beyond the FOV's radius."""
        place = self._middle + self._half * choices
        length = np.sqrt(np.square(place[..., 0]) + np.square(place[..., 1]))
        return place / np.maximum(1.0, np.float32(REACH) * length)[..., None]

    def _move(self, pointed: np.ndarray) -> None:
        """Toward the pointed places, at most a step; those that are gone are there at once."""
        way = pointed - self.place
        length = np.sqrt(np.square(way[..., 0]) + np.square(way[..., 1]))
        share = np.minimum(1.0, self._step / np.maximum(length, np.float32(1e-9)))
        share[self.silent == PATIENCE] = 1.0
        self.place += share[..., None] * way

    def _covered(self, disc: np.ndarray, observations: np.ndarray) -> np.ndarray:
        """Which own detections [W, n, D] lie inside the suppression discs [W, n, 3]."""
        points = observations[..., self._detections].reshape(*disc.shape[:2], -1, 2)
        centre = self._over_fov(disc[..., None, :2])
        radius = np.float32(WIDEST) * (0.5 + 0.5 * disc[..., 2:]) ** 3
        off = points - centre
        return np.square(off[..., 0]) + np.square(off[..., 1]) < np.square(radius)

    def remember(self, out: np.ndarray) -> None:
        w, n, phantoms = self.silent.shape
        presence = np.float32(1.0) - self.silent * np.float32(1.0 / PATIENCE)
        state = np.concatenate([self.place * (presence > 0.0)[..., None], presence[..., None]], axis=-1)
        out[...] = state.reshape(w, n, 3 * phantoms)


def _count(n: int | None, context: PolicyContext) -> int:
    """Phantoms per learner."""
    slots = context.scenario.injection.slots
    if n is None:
        budgets = [context.scenario.agent(int(k)).budget.injections for k in context.agents]
        return min(max(budgets), slots)
    if n > slots:
        name = context.scenario.name
        raise refuse(Phantoms.name, "n", n, f"at most {slots}, the injection slots of scenario {name!r}")
    return n


def _boxes(context: PolicyContext, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle and half size [n, 1, 2] of the learners' FOV boxes, relative to the agent, in `reach`."""
    headings = np.array([context.scenario.agent(int(k)).heading for k in context.agents])
    there = np.zeros_like(headings)
    pose = np.stack([there, there, np.cos(headings), np.sin(headings)], axis=-1)
    box = Fovs.of(context.scenario, context.agents).boxes(pose)
    low, high = box[:, None, 0::2] / reach[:, None, None], box[:, None, 1::2] / reach[:, None, None]
    return ((low + high) / 2).astype(np.float32), ((high - low) / 2).astype(np.float32)
