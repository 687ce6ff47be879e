"""More phantoms than slots: the learner places and withdraws them, and the wrapper reports those in need."""

from __future__ import annotations

import numpy as np
from gymnasium.spaces import MultiDiscrete

from trust_env.agents.base import PolicyContext
from trust_env.agents.parameters import non_negative, non_negative_or_none, one_of, whole_number, whole_number_or_none
from trust_env.agents.search_ranges import noise_deviation
from trust_env.agents.track_forecast import TrackForecast
from trust_env.agents.wrappers.reference_frame import KINDS, OUTWARD, Points, ReferenceFrame
from trust_env.agents.wrappers.spots import Spots
from trust_env.agents.wrappers.suppression import CHOICES, suppressed
from trust_env.agents.wrappers.wrapper import ActionWrapper
from trust_env.spaces.action import ActionTable
from trust_env.spaces.observation import KNOWLEDGE, REACH

PER_SLOT = 5  # phantoms: about as many as reports of one slot keep alive where nobody else looks
SPACING = 8.0  # between phantoms, in standard deviations of the sensors' noise
NOWHERE, NOBODY_ELSE, NO_HONEST, ANYWHERE = range(4)  # choices of where in a cell
NONE_AT_FIRST = (0.98, 0.8, 0.8)  # probability of no withdrawal, no doubles and no suppression
_NONE = -1


class ByNeed(ActionWrapper):
    """`MultiDiscrete([C] * placed + [4, 1 + C, 1 + M, 4])`: the cells in which phantoms appear; where in them; the cell
    from which a phantom is withdrawn, from 1, or 0; how many targets get a double; which own detections are suppressed.

    The C cells are those of a g x g grid over the square about the FOV. A phantom appears on the free spot of its cell
    where the fewest honest agents and then the fewest other learners look, as far as the knowledge level tells, and
    stays until it is withdrawn: 0 not at all, 1 if nobody else looks there, 2 if no honest agent does, 3 in any case.
    The learner's M slots first report doubles: the farthest own detections once more, `beside` from where they are. The
    others report phantoms by need: confirmed tracks that are about to be deleted, then those nearest to confirmation,
    as a forecast of the tracker tells. Suppressed are 0 none, 1 those in the nearer half of the FOV, 2 the others, 3
    all.

    A learner also sees for every cell its phantoms, those with a confirmed track, free spots, and those that no
    honest agent sees and that no one else sees; then its phantoms, their confirmed tracks, and slots that these need.

    g            cells along x and along y
    n            phantoms per learner; None: five per injection slot
    placed       phantoms that can appear in a frame
    spacing      m, least distance between phantoms, never below a twelfth of the FOV's radius; None: eight deviations
                 of the noise
    beside       standard deviations of the noise, along the area's x axis, between a target and its double
    frame        outward | area: the directions of the grid
    knowledge    level whose fields a learner sees; None: the scenario's
    """

    name = "by_need"
    hidden_fields = frozenset({"role", "time", "report", "report_mask"})  # without a clock, episodes of any length do

    spot: np.ndarray  # int64[W, n, P], of every phantom, -1 where there is none

    def __init__(
        self,
        g: int = 7,
        n: int | None = None,
        placed: int = 2,
        spacing: float | None = None,
        beside: float = 1.0,
        frame: str = OUTWARD,
        knowledge: str | None = None,
    ):
        super().__init__(knowledge)
        self.g, self.placed = whole_number(self.name, "g", g, 2), whole_number(self.name, "placed", placed, 1)
        self.n = whole_number_or_none(self.name, "n", n, 1, "five per injection slot")
        self.spacing = non_negative_or_none(self.name, "spacing", spacing, "m", "eight deviations of the noise")
        self.beside = non_negative(self.name, "beside", beside, "standard deviations")
        self.frame = one_of(self.name, "frame", frame, KINDS)

    # --- an episode begins ---

    def prepare(self, context: PolicyContext) -> int:
        scenario = context.scenario
        budgets = [scenario.agent(int(k)).budget.injections for k in context.agents]
        self._slots = np.minimum(budgets, scenario.injection.slots)[:, None]  # [n, 1]
        self._most = int(self._slots.max())
        self.phantoms = max(1, PER_SLOT * self._most) if self.n is None else self.n
        spacing = SPACING * noise_deviation(scenario) if self.spacing is None else self.spacing
        self.reference = ReferenceFrame(self.frame, context, self.fields)
        self.spots = Spots(context, spacing, self.g, KNOWLEDGE[self.knowledge or "own"] >= KNOWLEDGE["poses"])
        shape = (len(context.worlds), len(context.agents), self.phantoms)
        self.spot, self.forecast = np.full(shape, _NONE), TrackForecast(scenario, context.agents, shape)
        reach = context.observation_table.scales.reach[context.agents][:, None]
        self._shift = (self.beside * noise_deviation(scenario) / reach).astype(np.float32)  # [n, 1]
        self._suppressions = ActionTable(scenario)["suppressions"]
        cells = len(self.spots.members)
        self.sizes = [cells] * self.placed + [ANYWHERE + 1, 1 + cells, 1 + self._most, CHOICES]
        self.action_space = MultiDiscrete(self.sizes)
        self.first_logits = self._first_logits()
        return self._maps * cells + 3

    def _first_logits(self) -> np.ndarray:
        """Logits under which phantoms are seldom withdrawn, and doubles and suppression are seldom."""
        logits = [np.zeros(size) for size in self.sizes]
        for choice, none in zip(logits[-3:], NONE_AT_FIRST):
            choice[0] = np.log(none / (1.0 - none) * max(1, len(choice) - 1))
        return np.concatenate(logits)

    def clear(self, mask: np.ndarray) -> None:
        self.spot[mask] = _NONE
        self.forecast.clear(np.flatnonzero(mask))

    def state(self) -> dict[str, np.ndarray]:
        return {"spot": self.spot, **self.forecast.state()}

    # --- what a learner sees ---

    @property
    def _maps(self) -> int:
        return 5 if self.spots.knows_honest else 3

    def add_own_fields(self, seen: np.ndarray, observations: np.ndarray) -> None:
        self._look(observations)
        self.reference.rotate_fields(seen, observations)
        own, confirmed = self.spot != _NONE, self.forecast.confirmed
        maps = self.spots.maps(np.maximum(self.spot, 0), own, confirmed)[:, :, : self._maps]
        out = seen[..., sum(self.fields.values()) :]
        out[..., :-3] = maps.reshape(*maps.shape[:2], -1)
        out[..., -3], out[..., -2] = own.mean(axis=2), (own & confirmed).mean(axis=2)
        needed = (self.forecast.demand(self._watchers()) * (self.forecast.exists & own)).sum(axis=2)
        out[..., -1] = np.minimum(needed / max(1, 2 * self._most), 1.0)

    def _look(self, observations: np.ndarray) -> None:
        """Take the learners' poses of the present frame, and who looks where."""
        self.reference.set_poses(observations)
        self.spots.update(observations, self.reference.axis)

    def _taken(self) -> np.ndarray:
        """Which spots hold a phantom, bool[W, n, S]."""
        w, n, _ = self.spot.shape
        taken = np.zeros((w, n, len(self.spots.offset) + 1), dtype=bool)
        np.put_along_axis(taken, self.spot, True, axis=2)
        return taken[..., :-1]

    def _watchers(self) -> np.ndarray:
        """How many agents look at every phantom, int[W, n, P]; of honest ones those that are known."""
        honest, others = self.spots.lookers(np.maximum(self.spot, 0))
        return 1 + honest + others

    # --- what it does ---

    def act(self, choices: np.ndarray, observations: np.ndarray) -> np.ndarray:
        self._look(observations)
        sight, withdrawn, doubles, suppress = np.moveaxis(choices[..., self.placed :], -1, 0)
        self._withdraw(withdrawn)
        for turn in range(self.placed):
            self._place(choices[..., turn], sight)
        positions, fire = self._doubles(doubles[..., None], observations)
        watchers = self._watchers()
        phantoms, due = self._due(watchers, self._slots - fire.sum(axis=2, keepdims=True))
        self._forecast(phantoms, due, watchers, observations)
        return self._encode(positions, fire, phantoms, due, suppress[..., None], observations)

    def _withdraw(self, choice: np.ndarray) -> None:
        """The phantom of the chosen cell whose forecast score is least."""
        chosen = (self.spot != _NONE) & (self.spots.cell[self.spot] == choice[..., None] - 1)
        least = np.where(chosen, self.forecast.score, np.inf).argmin(axis=2)[..., None]
        gone = np.zeros(chosen.shape, dtype=bool)
        np.put_along_axis(gone, least, np.take_along_axis(chosen, least, axis=2), axis=2)
        self.spot[gone] = _NONE
        self.forecast.exists[gone] = self.forecast.confirmed[gone] = False

    def _place(self, cell: np.ndarray, sight: np.ndarray) -> None:
        """A phantom in cell[W, n], if there is a free spot in sight of those who may see it."""
        spot, found = self.spots.best(cell, self._taken())
        honest, others = (values[..., 0] for values in self.spots.lookers(spot[..., None]))
        unseen = np.where(honest == 0, np.where(others == 0, NOBODY_ELSE, NO_HONEST), ANYWHERE)
        found &= unseen <= sight
        free = self.spot == _NONE
        first = free.argmax(axis=2)[..., None]
        found = found[..., None] & np.take_along_axis(free, first, axis=2)
        now = np.where(found, spot[..., None], np.take_along_axis(self.spot, first, axis=2))
        np.put_along_axis(self.spot, first, now, axis=2)

    def _doubles(self, count: np.ndarray, observations: np.ndarray) -> tuple[Points, np.ndarray]:
        """The farthest own detections once more, [W, n, M], and which of them there are."""
        detections = self.reference.detections(observations)
        order = np.argsort(-np.abs(detections), axis=2, kind="stable")[..., : self._most]
        farthest = np.take_along_axis(detections, order, axis=2)
        fire = (farthest != 0) & (np.arange(self._most) < np.minimum(count, self._slots))
        return farthest + self._shift * np.conj(self.reference.axis), fire

    def _due(self, watchers: np.ndarray, slots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The phantoms int[W, n, M] that are reported in `slots` [W, n, 1], and which of them are."""
        wanted = self.spot != _NONE
        urgency = self.forecast.urgency(wanted, watchers, slots)
        phantom = np.argsort(-urgency, axis=2, kind="stable")[..., : self._most]
        return phantom, np.take_along_axis(wanted, phantom, axis=2) & (np.arange(self._most) < slots)

    def _forecast(self, phantom: np.ndarray, due: np.ndarray, watchers: np.ndarray, observations: np.ndarray) -> None:
        """One frame on, in which the phantoms[W, n, M] that are due are reported."""
        hit = np.zeros(self.spot.shape, dtype=bool)
        np.put_along_axis(hit, phantom, due, axis=2)
        pose = self.context.observation_table.read(observations, self.context.agents, "pose")
        points = self.spots.positions(self._offsets(), pose, self.reference.axis)
        self.forecast.update(hit, points, watchers)

    def _offsets(self) -> Points:
        """Where the phantoms stand in their FOVs, in radii, [W, n, P]."""
        return self.spots.offset[np.maximum(self.spot, 0)]

    def _encode(
        self,
        doubles: Points,
        doubled: np.ndarray,
        phantom: np.ndarray,
        due: np.ndarray,
        suppress: np.ndarray,
        observations: np.ndarray,
    ) -> np.ndarray:
        """Raw actions float32[W, n, A], doubles in the first slots."""
        due = np.concatenate([doubled, due], axis=2)
        placed = np.take_along_axis(self._offsets(), phantom, axis=2) / np.float32(REACH)
        points = np.concatenate([doubles, placed], axis=2)
        first = np.argsort(~due, axis=2, kind="stable")[..., : self._most]
        due, points = np.take_along_axis(due, first, axis=2), np.take_along_axis(points, first, axis=2)
        out = np.zeros((*due.shape[:2], self._action_size), dtype=np.float32)
        x, y = self.reference.to_raw_action(points)
        for i, values in enumerate((due, x, y)):
            out[..., i : 3 * self._most : 3] = np.clip(values, -1.0, 1.0)
        out[..., self._suppressions] = suppressed(suppress, self.reference.detections(observations))
        return out
