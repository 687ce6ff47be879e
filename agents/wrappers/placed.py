"""Phantoms as wrappers keep them: placed once, and reported frame after frame."""

from __future__ import annotations

import numpy as np

from trust_env.agents.base import PolicyContext
from trust_env.agents.parameters import invalid, non_negative, one_of, whole_number_or_none
from trust_env.agents.wrappers.reference_frame import KINDS, Points, ReferenceFrame, clip_to_fov
from trust_env.agents.wrappers.wrapper import ActionWrapper
from trust_env.spaces.action import ActionTable
from trust_env.spaces.observation import REACH

MOST_TURNS = 2  # phantoms per slot: a tentative track outlives one frame without a report, not two


class PlacedPhantoms(ActionWrapper):
    """A phantom appears where the learner points, and stays until it is withdrawn; with a `speed` it moves
    where the learner steers it. So exploration noise does not break its track. More phantoms than injection
    slots take turns in them.

    A learner sees, of every phantom, its place relative to the agent (as detections are scaled), and 1 where
    there is one, else zeros. All is expressed in one reference frame, see `ReferenceFrame`.
    FOVs that are no circles report what lies outside them from where the environment moves it, inside.
    """

    hidden_fields = frozenset({"role", "report", "report_mask"})  # the own fields hold it in fewer numbers
    state_arrays = ("position", "exists", "clock")

    position: Points  # complex64[W, n, P], see `ReferenceFrame`
    exists: np.ndarray  # bool[W, n, P], whether there is a phantom
    clock: np.ndarray  # int64[W], frames since the episode began
    reference: ReferenceFrame

    def __init__(self, n: int | None, speed: float, frame: str, knowledge: str | None):
        super().__init__(knowledge)
        self.n = whole_number_or_none(self.name, "n", n, 1, "the largest injection budget")
        self.speed = non_negative(self.name, "speed", speed, "m/s")
        self.frame = one_of(self.name, "frame", frame, KINDS)

    def prepare(self, context: PolicyContext) -> int:
        self.phantoms, self._slots = self._count(context)
        self._turns = max(1, -(-self.phantoms // max(1, self._slots)))
        shape = (len(context.worlds), len(context.agents), self.phantoms)
        self.position, self.exists = np.zeros(shape, np.complex64), np.zeros(shape, dtype=bool)
        self.clock = np.zeros(shape[0], dtype=np.int64)
        self.reference = ReferenceFrame(self.frame, context, self.fields)
        reach = context.observation_table.scales.reach[context.agents]
        self._step = (self.speed * context.scenario.dt / reach).astype(np.float32)[:, None]
        self._suppressions = ActionTable(context.scenario)["suppressions"]
        return 3 * self.phantoms

    def _count(self, context: PolicyContext) -> tuple[int, int]:
        """Phantoms per learner, and the injection slots in which they take turns."""
        budgets = [context.scenario.agent(int(k)).budget.injections for k in context.agents]
        slots = min(max(budgets), context.scenario.injection.slots)
        n = slots if self.n is None else self.n
        if n > MOST_TURNS * slots:
            most = f"at most {MOST_TURNS * slots}, {MOST_TURNS} by turns in each of {slots} injection slots"
            raise invalid(self.name, "n", n, f"{most} of scenario {context.scenario.name!r}")
        return n, slots

    def clear(self, mask: np.ndarray) -> None:
        self.position[mask], self.exists[mask], self.clock[mask] = 0.0, False, 0

    def add_own_fields(self, seen: np.ndarray, observations: np.ndarray) -> None:
        self.reference.rotate_fields(seen, observations)
        out = seen[..., seen.shape[-1] - 3 * self.phantoms :]
        out[..., 0::3] = self.position.real * self.exists
        out[..., 1::3] = self.position.imag * self.exists
        out[..., 2::3] = self.exists

    def move(self, pointed: Points, steered: Points, kept: np.ndarray) -> None:
        """Move the phantoms by one frame; all arguments are [W, n, P].

        Existing ones move in the direction `steered` (1: at `speed`), new ones appear at `pointed`. Those
        whose turn it is are withdrawn unless `kept`.
        """
        moved = self.position
        if self.speed:
            moved = clip_to_fov((self.position + self._step * steered) * np.float32(REACH))
        self.position[...] = np.where(self.exists, moved, pointed)
        self.exists[...] = np.where(self._has_turn(), kept, self.exists)

    def _has_turn(self) -> np.ndarray:
        """Which phantoms have their turn in a slot in the present frame, bool[W, 1, P]."""
        turn = np.arange(self.phantoms) // max(1, self._slots)
        return (turn == (self.clock % self._turns)[:, None])[:, None]

    def encode(self, suppress: np.ndarray) -> np.ndarray:
        """Raw actions float32[W, n, A] that inject the phantoms whose turn it is, and suppress[W, n, D]."""
        w, n, phantoms = self.exists.shape
        injections = np.zeros((w, n, self._turns * self._slots, 3), dtype=np.float32)
        injections[..., :phantoms, 0] = self.exists
        x, y = self.reference.to_raw_action(self.position)
        injections[..., :phantoms, 1], injections[..., :phantoms, 2] = x, y
        turns = np.clip(injections, -1.0, 1.0).reshape(w, n, self._turns, 3 * self._slots)
        out = np.zeros((w, n, self._action_size), dtype=np.float32)
        out[..., : 3 * self._slots] = turns[np.arange(w), :, self.clock % self._turns]
        out[..., self._suppressions] = suppress
        self.clock += 1
        return out
