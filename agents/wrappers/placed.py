"""Phantoms as views keep them: placed once, and reported frame after frame."""

from __future__ import annotations

import numpy as np

from trust_env.agents.base import PolicyContext
from trust_env.agents.parameters import length, one_of, refuse, whole_or_none
from trust_env.agents.wrappers.reference_frame import KINDS, Frame, Places, over_fov
from trust_env.agents.wrappers.wrapper import View
from trust_env.spaces.action import ActionTable
from trust_env.spaces.observation import REACH

MOST_TURNS = 2  # phantoms per slot: a tentative track outlives one frame without a report, not two


class PlacedPhantoms(View):
    """A phantom appears where the learner points, and stays until it is withdrawn; with a `speed` it goes
    where the learner steers it. So the noise of exploration does not tear its track apart. More phantoms than
    injection slots take turns in them.

    A learner sees, of every phantom, its place relative to the agent (as detections are scaled), and 1 where
    there is one, else zeros. All is expressed in one frame of reference, see `reference_frame`.
    FOVs that are no circles report what lies outside them from where the environment moves it, inside.
    """

    hidden = frozenset({"role", "report", "report_mask"})  # the view's own state says it shorter
    remembered = ("place", "there", "clock")

    place: Places  # complex64[W, n, P], see `Frame`
    there: np.ndarray  # bool[W, n, P], whether there is a phantom
    clock: np.ndarray  # int64[W], frames since the episode began
    scene: Frame

    def __init__(self, n: int | None, speed: float, frame: str, knowledge: str | None):
        super().__init__(knowledge)
        self.n = whole_or_none(self.name, "n", n, 1, "the largest injection budget")
        self.speed = length(self.name, "speed", speed, "m/s")
        self.frame = one_of(self.name, "frame", frame, KINDS)

    def prepare(self, context: PolicyContext) -> int:
        self.phantoms, self._slots = self._count(context)
        self._turns = max(1, -(-self.phantoms // max(1, self._slots)))
        shape = (len(context.worlds), len(context.agents), self.phantoms)
        self.place, self.there = np.zeros(shape, np.complex64), np.zeros(shape, dtype=bool)
        self.clock = np.zeros(shape[0], dtype=np.int64)
        self.scene = Frame(self.frame, context, self.fields)
        reach = context.observation_table.scales.reach[context.agents]
        self._step = (self.speed * context.scenario.dt / reach).astype(np.float32)[:, None]
        self._suppressions = ActionTable(context.scenario)["suppressions"]
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

    def begin(self, mask: np.ndarray) -> None:
        self.place[mask], self.there[mask], self.clock[mask] = 0.0, False, 0

    def complete(self, seen: np.ndarray, observations: np.ndarray) -> None:
        self.scene.turn(seen, observations)
        out = seen[..., seen.shape[-1] - 3 * self.phantoms :]
        out[..., 0::3] = self.place.real * self.there
        out[..., 1::3] = self.place.imag * self.there
        out[..., 2::3] = self.there

    def move(self, pointed: Places, steered: Places, reported: np.ndarray) -> None:
        """A frame on, all [W, n, P]: those that are there go on in the direction `steered` (1: at `speed`),
        new ones appear where they are pointed to, those not reported are withdrawn.
        """
        stays = self.place
        if self.speed:
            stays = over_fov((self.place + self._step * steered) * np.float32(REACH))
        self.place[...] = np.where(self.there, stays, pointed)
        self.there[...] = np.where(self._due(), reported, self.there)

    def _due(self) -> np.ndarray:
        """Which phantoms have their turn in the present frame, bool[W, 1, P]."""
        turn = np.arange(self.phantoms) // max(1, self._slots)
        return (turn == (self.clock % self._turns)[:, None])[:, None]

    def actions(self, suppress: np.ndarray) -> np.ndarray:
        """Raw actions float32[W, n, A]: of the phantoms whose turn it is, and of suppress[W, n, D]."""
        w, n, phantoms = self.there.shape
        injections = np.zeros((w, n, self._turns * self._slots, 3), dtype=np.float32)
        injections[..., :phantoms, 0] = self.there
        injections[..., :phantoms, 1], injections[..., :phantoms, 2] = self.scene.raw(self.place)
        turns = np.clip(injections, -1.0, 1.0).reshape(w, n, self._turns, 3 * self._slots)
        out = np.zeros((w, n, self._action_size), dtype=np.float32)
        out[..., : 3 * self._slots] = turns[np.arange(w), :, self.clock % self._turns]
        out[..., self._suppressions] = suppress
        self.clock += 1
        return out
