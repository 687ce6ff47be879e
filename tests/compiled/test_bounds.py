"""That a run with NUMBA_BOUNDSCHECK=1 checks anything: an out-of-range read in a nested kernel must raise."""

from __future__ import annotations

import numpy as np
import pytest
from kernels import Bench, entry
from numba.core import config

from trust_env.compiled.kernels import kernel

BOUNDSCHECK = config.BOUNDSCHECK  # pyright: ignore[reportAttributeAccessIssue]


@kernel
def read_area(world, index):
    return world.targets.area[index]


@kernel
def read_pose(world, k, axis):
    return world.agents.pose[k, axis]


@entry
def run_reads(world, index, k, axis, out):
    out[0], out[1] = read_area(world, index), read_pose(world, k, axis)


@pytest.mark.core
@pytest.mark.parametrize(("index", "k", "axis"), [(4, 0, 0), (0, 5, 0), (0, 0, 3)])
def test_reads_beyond_a_field_raise(index, k, axis):
    out = np.zeros(2)
    bench = Bench("patrol")
    run_reads(bench.world, np.int64(3), np.int64(4), np.int64(2), out)
    assert out[0] == bench["target_area"][3] and out[1] == bench["pose"][4, 2]
    if not BOUNDSCHECK:
        pytest.skip("runs with NUMBA_BOUNDSCHECK=1")
    with pytest.raises(IndexError):
        run_reads(bench.world, np.int64(index), np.int64(k), np.int64(axis), out)
