"""The frame's GOSPA and OSPA for any two sets of points: the same kernel, on scratch memory of its own."""

from __future__ import annotations

import numpy as np

from trust_env.compiled.jit import Entry
from trust_env.world.fields import Layout, World
from trust_env.world.scoring import set_distances


def _distances(scratch, layout, n_estimates, n_truths, cutoff, order):
    nothing = np.int64(0)
    world = World(nothing, nothing, np.int64(scratch.ctypes.data), np.int64(layout.ctypes.data))
    return set_distances(world, n_estimates, n_truths, cutoff, order)


_run = Entry(_distances)


def point_distances(
    estimates: np.ndarray, truths: np.ndarray, cutoff: float, order: float
) -> tuple[float, float, float, int]:
    """GOSPA, OSPA, the localisation part of GOSPA^p, assigned pairs; `estimates[n, 2]`, `truths[m, 2]`."""
    n, m = len(estimates), len(truths)
    layout = Layout(dict.fromkeys("KNDJLMAVTHO", 1) | {"R": max(1, n), "C": max(1, m), "P": max(1, n * m)})
    scratch = np.zeros(layout.scratch_bytes, dtype=np.uint8)
    layout.view(scratch, "estimates")[:n] = estimates
    layout.view(scratch, "truths")[:m] = truths
    return _run(scratch, layout.table, np.int64(n), np.int64(m), np.float64(cutoff), np.float64(order))
