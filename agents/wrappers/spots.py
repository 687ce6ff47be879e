"""Places for phantoms: the points of a lattice in each learner's FOV, in the cells that a learner chooses from."""

from __future__ import annotations

import numpy as np

from trust_env.agents.base import PolicyContext
from trust_env.agents.witnesses import Witnesses
from trust_env.agents.wrappers.reference_frame import Points
from trust_env.scenario import Fovs

WELL_INSIDE = 0.02  # margin, as a fraction of the distance to the middle of an FOV
LEAST_SPACING = 1.0 / 12.0  # FOV radii: at most some 500 spots
ROOMS = 3  # kinds of free spots


class Spots:
    """S points of a hexagonal lattice, `spacing` (m) apart, about each of n learners, in C cells of at most K spots.

    The lattice is the same for all learners in radii of their FOVs; the spacing is that of the smallest FOV. The
    cells are those of a g x g grid over the square about the FOV that hold a spot.
    """

    offset: Points  # complex64[S], FOV radii
    members: np.ndarray  # int[C, K], the spots of each cell, the nearest to its middle first; S where there is none
    cell: np.ndarray  # int[S], of each spot
    usable: np.ndarray  # bool[W, n, S], inside the FOV
    honest: np.ndarray  # int8[W, n, S], agents that are no learners and look there; 0 where that is not known
    others: np.ndarray  # int8[W, n, S], other learners that look there

    def __init__(self, context: PolicyContext, spacing: float, g: int, shows_poses: bool):
        self._context, self._fovs = context, Fovs.of(context.scenario, context.agents)
        self.radius = np.array([context.scenario.agent(int(k)).fov.shape.reach for k in context.agents])  # [n], m
        self.offset = lattice(max(spacing / self.radius.min(), LEAST_SPACING))
        self.members, self.cell = cells(self.offset, g)
        self._witnesses = Witnesses(context) if shows_poses else None
        shape = (len(context.worlds), len(context.agents), len(self.offset))
        self.usable, self.honest = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=np.int8)
        self.others = np.zeros(shape, dtype=np.int8)
        self._room = np.zeros((*shape[:2], ROOMS, len(self.members)), dtype=np.float32)
        self._known: np.ndarray | None = None  # poses of the last `update`

    @property
    def knows_honest(self) -> bool:
        """Whether there are honest agents, and it is known where they look."""
        return self._witnesses is not None and len(self._witnesses.agents) > 0

    def update(self, observations: np.ndarray, axis: Points) -> None:
        """Who looks where, from observations[W, n, O] and the directions axis[W, n, 1] of the lattice; only in worlds
        in which somebody moved.
        """
        names = ("pose",) if self._witnesses is None else ("pose", "poses")
        table = self._context.observation_table
        poses = np.concatenate([observations[..., table[name].slice] for name in names], axis=-1)
        moved = np.ones(len(poses), dtype=bool)
        if self._known is not None:
            moved = (poses != self._known).any(axis=(1, 2))
        rows = np.flatnonzero(moved)
        self._known = poses
        if rows.size:
            turned = np.broadcast_to(axis, (*self.usable.shape[:2], 1))[rows]
            self._look(rows, table.read(observations[rows], self._context.agents, names), turned)

    def _look(self, rows: np.ndarray, seen: dict[str, np.ndarray], axis: Points) -> None:
        points = self.positions(self.offset, seen["pose"], axis)  # [w, n, S, 2]
        flat = points.reshape(len(rows), 1, -1, 2)
        looks = self._fovs.contains(seen["pose"], flat).reshape(len(rows), -1, *points.shape[1:-1])  # [w, n, n, S]
        own = np.arange(looks.shape[1])
        self.usable[rows] = self._fovs.contains(seen["pose"], points, WELL_INSIDE)
        self.others[rows] = looks.sum(axis=1) - looks[:, own, own]
        if self._witnesses is not None:
            self.honest[rows] = self._witnesses.see(seen, points).sum(axis=1)
        everywhere = np.broadcast_to(np.arange(len(self.offset)), points.shape[:-1])
        self._room[rows] = self._count(everywhere, self._kinds(rows, everywhere))

    def lookers(self, spot: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How many honest agents, and how many other learners, look at spot[W, n, P], int64[W, n, P] each."""
        honest, others = (np.take_along_axis(values, spot, axis=2) for values in (self.honest, self.others))
        return honest.astype(np.int64), others.astype(np.int64)

    def _kinds(self, rows: np.ndarray | slice, spot: np.ndarray) -> list[np.ndarray]:
        """Of spots[w, n, P] which are in the FOV, which no honest agent sees either, and which nobody else sees."""
        usable, honest, others = (
            np.take_along_axis(values[rows], spot, axis=2) for values in (self.usable, self.honest, self.others)
        )
        unwatched = usable & (honest == 0)
        return [usable, unwatched, unwatched & (others == 0)]

    def _count(self, spot: np.ndarray, of: list[np.ndarray]) -> np.ndarray:
        """How many of spot[w, n, P] are in each cell, of several kinds[w, n, P], float32[w, n, kinds, C]."""
        (w, n, _), cells = spot.shape, len(self.members)
        at = self.cell[spot] + cells * np.arange(w * n).reshape(w, n, 1)
        counts = [np.bincount(at[kind], minlength=w * n * cells).reshape(w, n, cells) for kind in of]
        return np.stack(counts, axis=2).astype(np.float32)

    def maps(self, spot: np.ndarray, exists: np.ndarray, confirmed: np.ndarray) -> np.ndarray:
        """By cells, as fractions of K, float32[W, n, 2 + ROOMS, C]: phantoms, those of confirmed[W, n, P], and free
        spots, those that no honest agent sees, and those that nobody else sees; the phantoms are those of exists[W,
        n, P] on spot[W, n, P].
        """
        taken = [exists & kind for kind in self._kinds(slice(None), spot)]
        counts = self._count(spot, [exists, exists & confirmed, *taken])
        counts[:, :, 2:] = self._room - counts[:, :, 2:]
        return counts / np.float32(self.members.shape[1])

    def positions(self, offset: Points, pose: np.ndarray, axis: Points) -> np.ndarray:
        """m, [w, n, ..., 2] of points offset[..., S or P] (FOV radii) about poses pose[w, n, 4]."""
        turned = offset * axis * self.radius[:, None]
        return np.stack([pose[..., 0:1] + turned.real, pose[..., 1:2] + turned.imag], axis=-1)

    def best(self, cell: np.ndarray, taken: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The spot int[W, n] of cell[W, n] that the fewest honest agents, then the fewest other learners see, then the
        nearest to the middle; and whether there is one that is not taken[W, n, S], bool.
        """
        candidates = self.members[cell]  # [W, n, K]
        spot = np.minimum(candidates, len(self.offset) - 1)
        at = np.arange(len(taken))[:, None, None], np.arange(taken.shape[1])[:, None], spot
        free = (candidates < len(self.offset)) & self.usable[at] & ~taken[at]
        cost = self.honest[at].astype(np.int32) * (taken.shape[1] + 1) + self.others[at]
        chosen = np.where(free, cost, np.iinfo(np.int32).max).argmin(axis=-1)[..., None]
        return np.take_along_axis(spot, chosen, axis=-1)[..., 0], np.take_along_axis(free, chosen, axis=-1)[..., 0]


def lattice(spacing: float) -> Points:
    """Points within 1 of the origin, the nearest first, each `spacing` from its six neighbours."""
    count = int(np.ceil(1.0 / spacing)) + 1
    row, column = np.mgrid[-count : count + 1, -count : count + 1]
    points = (spacing * ((column + 0.5 * (row % 2)) + 1j * np.sqrt(0.75) * row)).reshape(-1)
    points = points[np.abs(points) <= 1.0]
    return points[np.argsort(np.abs(points), kind="stable")].astype(np.complex64)


def cells(offset: Points, g: int) -> tuple[np.ndarray, np.ndarray]:
    """The members int[C, K] of the cells of a g x g grid that hold a point, and the cell int[S] of each point."""
    along = np.clip(np.floor((np.stack([offset.real, offset.imag]) + 1.0) / 2.0 * g), 0, g - 1).astype(np.int64)
    found, cell = np.unique(along[0] * g + along[1], return_inverse=True)
    middle = (found // g + 1j * (found % g) + (0.5 + 0.5j)) * 2.0 / g - (1.0 + 1.0j)
    most = int(np.bincount(cell).max())
    members = np.full((len(found), most), len(offset))
    for i in range(len(found)):
        own = np.flatnonzero(cell == i)
        members[i, : own.size] = own[np.argsort(np.abs(offset[own] - middle[i]), kind="stable")]
    return members, cell
