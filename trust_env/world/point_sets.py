"""Distances between a set of estimates and a set of truths, in the plane: GOSPA and OSPA."""

from __future__ import annotations

import math

import numpy as np

from trust_env.compiled.entry import Entry
from trust_env.compiled.kernels import inlined, kernel
from trust_env.compiled.layout import SCRATCH, Layout
from trust_env.compiled.structs import floats_at, world_at
from trust_env.world.tracking.association import least_cost_assignment


@inlined
def _root(value, order):
    return math.sqrt(value) if order == 2.0 else value ** (1.0 / order)


@kernel
def set_distances(world, n_estimates, n_truths, cutoff, order):
    """GOSPA with α = 2 (Rahmathullah, García-Fernández & Svensson 2017, Prop. 1) and OSPA (Schuhmacher, Vo &
    Vo 2008) of two sets of points.

    Both minimise Σ min(d, c)^p over assignments. Points in `scratch.estimates[·, 2]` and `scratch.truths[·, 2]`.
    Returns GOSPA, OSPA, the localisation part of GOSPA^p, and the number of pairs assigned within the cutoff.

    Distances are counted in `unit`, so that c lies in [0.5, 1) and no power overflows; as that is a power of two, it
    costs no digit.
    """
    reach, exponent = math.frexp(cutoff)
    unit, per_unit = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    pairs, limit, found = world.pairs, reach**order, 0
    for r in range(n_estimates):
        pairs.start[r] = found
        x, y = world.scratch.estimates[r, 0], world.scratch.estimates[r, 1]
        for c in range(n_truths):
            dx, dy = per_unit * (x - world.scratch.truths[c, 0]), per_unit * (y - world.scratch.truths[c, 1])
            squared = dx * dx + dy * dy
            pairs.column[found], pairs.cost[found] = c, squared
            found += int(squared < reach * reach)
    pairs.start[n_estimates] = found
    if order != 2.0:
        for p in range(found):
            pairs.cost[p] **= 0.5 * order
    least_cost_assignment(world, n_estimates, n_truths, limit)
    assigned, localisation = 0, 0.0
    for r in range(n_estimates):
        for p in range(pairs.start[r], pairs.start[r + 1]):
            if pairs.column[p] == world.matching.row_column[r]:
                assigned += 1
                localisation += pairs.cost[p]
    unassigned = n_estimates + n_truths - 2 * assigned
    gospa = _root(localisation + 0.5 * limit * unassigned, order)
    most = max(n_estimates, n_truths)
    ospa = _root((localisation + limit * (most - assigned)) / most, order) if most > 0 else 0.0
    return unit * gospa, unit * ospa, localisation * unit**order, assigned


def _distances(scratch, layout, n_estimates, n_truths, numbers):
    world, values = world_at(0, 0, scratch, 0, layout), floats_at(numbers, 6)
    values[2], values[3], values[4], values[5] = set_distances(world, n_estimates, n_truths, values[0], values[1])


_run = Entry(_distances)


def point_distances(
    estimates: np.ndarray, truths: np.ndarray, cutoff: float, order: float
) -> tuple[float, float, float, int]:
    """GOSPA, OSPA, the localisation part of GOSPA^p, assigned pairs; `estimates[n, 2]`, `truths[m, 2]`."""
    n, m = len(estimates), len(truths)
    lengths = {"R": max(1, n), "S": n + 1, "C": max(1, m), "P": max(1, n * m), "D": 1}
    layout = Layout(lengths, ("pairs", "matching", "scratch"))
    scratch = np.zeros(layout.sizes[SCRATCH], dtype=np.uint8)
    layout.view(scratch, "scratch_estimates")[:n] = estimates
    layout.view(scratch, "scratch_truths")[:m] = truths
    numbers = np.array([cutoff, order, 0.0, 0.0, 0.0, 0.0])
    _run(scratch.ctypes.data, layout.table.ctypes.data, n, m, numbers.ctypes.data)
    _, _, gospa, ospa, localisation, pairs = numbers.tolist()
    return gospa, ospa, localisation, int(pairs)
