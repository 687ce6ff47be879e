"""Phantoms at the best of many random places: where fewest see them who should not, and most who can report them."""

from __future__ import annotations

import numpy as np

from trust_env.agents.attacks.phantoms import Phantoms
from trust_env.agents.base import CANDIDATE, PolicyContext
from trust_env.agents.witnesses import Witnesses

CANDIDATES = 512  # places that are compared for a group of phantoms
CHUNK = 32  # worlds at a time, so that the candidates of many worlds need not fit into memory at once
WELL_INSIDE = 0.05  # margin, as a fraction of the distance to the middle of an FOV
FORBIDDEN = -(1 << 40)  # rank of a place where no phantom may stand
TOO_NEAR = -(1 << 30)  # added to the rank of a place near another phantom


class PlacedPhantoms(Phantoms):
    """Phantoms at the places of least `cost`, and among those where most adversaries see them."""

    least_distance: float = 0.0  # m, between phantoms, where there is room
    max_cost: int | None = None  # greatest cost of a place; None: no limit

    def cost(self, seen: dict[str, np.ndarray], points: np.ndarray) -> np.ndarray:
        """How unwelcome phantoms at points[w, G, Q, 2] are, int[w, G, Q]; phantoms move where it stays as low."""
        return np.zeros(points.shape[:-1], dtype=np.int64)

    def prepare(self, context: PolicyContext) -> None:
        super().prepare(context)
        self._limit = np.zeros(self.position.shape[:-1], dtype=np.int64)

    # --- an episode begins ---

    def place(self, rows: np.ndarray, seen: dict[str, np.ndarray]) -> None:
        for first in range(0, rows.size, CHUNK):
            part = slice(first, first + CHUNK)
            self._place(rows[part], {name: values[part] for name, values in seen.items()})
        if self.is_moving:
            self.velocity[rows] = self.draw_velocities(rows)

    def _place(self, rows: np.ndarray, seen: dict[str, np.ndarray]) -> None:
        """The best candidates in the worlds `rows`; of equally good ones the first."""
        points = self._candidates(rows, seen["pose"])  # [w, G, C, 2]
        held = self.fovs.contains(seen["pose"], points)  # [w, n, C]
        cost = self.cost(seen, points)
        rank = self._rank(seen["pose"], points, held, cost)
        if self.least_distance or (self.is_shared and self._count > self.budgets().min(initial=0)):
            best, allowed, reports = self._choose_in_turn(points, held, rank)
        else:
            best = np.argsort(-rank, axis=2, kind="stable")[..., : self._count]
            allowed = np.take_along_axis(rank, best, axis=2) > FORBIDDEN
            reports = allowed & np.take_along_axis(
                held, np.broadcast_to(best, (*held.shape[:2], best.shape[2])), axis=2
            )
        self.position[rows] = np.take_along_axis(points, best[..., None], axis=2)
        self._limit[rows] = np.take_along_axis(cost, best, axis=2)
        self.reports[rows] = reports & (np.cumsum(reports, axis=2) <= self.budgets()[:, None])

    def _candidates(self, rows: np.ndarray, pose: np.ndarray) -> np.ndarray:
        """Uniform points [w, G, C, 2] (m): in the own FOVs; of a group that is shared, by turns in the box that the
        FOVs' boxes share and in an FOV.
        """
        agents, groups = len(self.context.agents), self._group_agents()
        draws = self.draw(CANDIDATE, 3 * CANDIDATES, rows, groups)
        draws = draws.reshape(len(rows), len(groups), CANDIDATES, 3)
        if not self.is_shared:
            return self.fovs.sample(pose, draws)
        box = self.fovs.boxes(pose)  # [w, n, 4]
        low, high = box[..., 0::2].max(axis=1)[:, None], box[..., 1::2].min(axis=1)[:, None]  # [w, 1, 2]
        shared = low + draws[:, 0, :, :2] * (high - low)
        own = self.fovs.sample(pose, np.broadcast_to(draws, (len(rows), agents, CANDIDATES, 3)))
        turn = np.arange(CANDIDATES)
        own = own[:, turn // 2 % agents, turn]
        overlap = (high > low).all(axis=-1, keepdims=True)  # [w, 1, 1]
        return np.where(overlap & (turn % 2 == 0)[:, None], shared, own)[:, None]

    def _rank(self, pose: np.ndarray, points: np.ndarray, held: np.ndarray, cost: np.ndarray) -> np.ndarray:
        """How good the candidates are, int[w, G, C]: little cost, then many own FOVs that hold them, then many that
        hold them well inside; FORBIDDEN where no phantom may stand.
        """
        well, most = self.fovs.contains(pose, points, WELL_INSIDE), held.shape[1] + 1
        if self.is_shared:
            held, well = held.sum(axis=1, keepdims=True), well.sum(axis=1, keepdims=True)
        forbidden = held == 0
        if self.max_cost is not None:
            forbidden = forbidden | (cost > self.max_cost)
        return np.where(forbidden, FORBIDDEN, most * held + well - most * most * cost)

    def _choose_in_turn(
        self, points: np.ndarray, held: np.ndarray, rank: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The candidates int[w, G, P] of phantoms that are placed one after the other, if possible `least_distance`
        apart; whether each may stand there, bool; and who reports it, bool[w, n, P].
        """
        (w, n, _), groups, world = held.shape, rank.shape[1], np.arange(len(held))
        best, reports = np.zeros((w, groups, self._count), dtype=np.int64), np.zeros((w, n, self._count), dtype=bool)
        allowed, left = np.zeros(best.shape, dtype=bool), np.tile(self.budgets(), (w, 1))
        for p, g in np.ndindex(self._count, groups):
            whose = slice(None) if self.is_shared else slice(g, g + 1)
            can = held[:, whose] & (left[:, whose, None] > 0)  # [w, n or 1, C]
            # How many may report this phantom, so that there are slots for the others.
            most = np.maximum(left[:, whose].sum(axis=1) // (self._count - p), 1)[:, None]
            silent = np.maximum(held[:, whose].sum(axis=1) - most, 0)  # adversaries that would contradict it
            now = np.where(can.any(axis=1), rank[:, g] - (n + 1) ** 2 * silent, FORBIDDEN)
            at = best[:, g, p] = now.argmax(axis=1)
            allowed[:, g, p] = now[world, at] > FORBIDDEN
            free = np.where(can[world, :, at], left[:, whose], 0)
            place = np.argsort(np.argsort(-free, axis=1, kind="stable"), axis=1, kind="stable")
            reports[:, whose, p] = allowed[:, g, p, None] & (free > 0) & (place < most)
            left[:, whose] -= reports[:, whose, p]
            rank = self._without(rank, points, points[world, g, at], allowed[:, g, p])
        return best, allowed, reports

    def _without(self, rank: np.ndarray, points: np.ndarray, taken: np.ndarray, allowed: np.ndarray) -> np.ndarray:
        """The rank of the candidates when a phantom stands at taken[w, 2], where that is allowed[w]."""
        dx, dy = points[..., 0] - taken[:, None, None, 0], points[..., 1] - taken[:, None, None, 1]
        distance2 = np.where(allowed[:, None, None], dx * dx + dy * dy, np.inf)
        near = (distance2 < self.least_distance**2) & (rank > TOO_NEAR)
        return np.where(distance2 == 0.0, FORBIDDEN, np.where(near, rank + TOO_NEAR, rank))

    # --- every frame ---

    def zone(self, seen: dict[str, np.ndarray], points: np.ndarray, rows: np.ndarray | slice) -> np.ndarray:
        there = seen if isinstance(rows, slice) else {name: values[rows] for name, values in seen.items()}
        return super().zone(seen, points, rows) & (self.cost(there, points) <= self._limit[rows])

    def replace(self, seen: dict[str, np.ndarray], left: np.ndarray, before: np.ndarray) -> None:
        """The first candidates in the zones of those that have left; without one they stay where they were."""
        rows = np.flatnonzero(left.any(axis=(1, 2)))
        there = {name: values[rows] for name, values in seen.items()}
        points = self._candidates(rows, there["pose"])
        held = self.fovs.contains(there["pose"], points)  # [w, n, C]
        if self.is_shared:
            held = ~(self.reports[rows].swapaxes(1, 2).astype(np.int64) @ (~held).astype(np.int64)).astype(bool)[
                :, None
            ]
        else:
            held = held[:, :, None]
        zone = held & (self.cost(there, points)[:, :, None] <= self._limit[rows][..., None])  # [w, G, P, C]
        at = zone.argmax(axis=-1)
        found = np.take_along_axis(points, at[..., None], axis=2)
        found = np.where(zone.any(axis=-1, keepdims=True), found, before[rows])
        self.position[rows] = np.where(left[rows][..., None], found, self.position[rows])
        self.velocity[rows] = np.where(left[rows][..., None], self.draw_velocities(rows), self.velocity[rows])


class HonestWitnesses(PlacedPhantoms):
    """Phantoms whose places depend on which agents outside the coalition, who count as honest, see them."""

    knowledge = "poses"
    reads = ("pose", "detections_mask", "poses")

    def prepare(self, context: PolicyContext) -> None:
        super().prepare(context)
        self.witnesses = Witnesses(context)

    def cost(self, seen: dict[str, np.ndarray], points: np.ndarray) -> np.ndarray:
        return self.witnesses.see(seen, points).sum(axis=1)
