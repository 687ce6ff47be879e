"""Kernels that are compiled apart do what they do in one piece, and are compiled only for those who call them."""

from __future__ import annotations

import numpy as np
import pytest
from kernels import Bench, entry

import trust_env
from trust_env.compiled import mode
from trust_env.compiled.apart import call_apart, kernels_apart
from trust_env.compiled.kernels import kernel
from trust_env.defenses import DEFENSES
from trust_env.frame import defense_entry


@kernel
def mark_first(world):
    world.agents.pose[0, 0] = world.targets.area[1]


@kernel
def mark_beyond(world):
    world.agents.pose[0, 1] = world.targets.area[world.parameters.horizon]


@entry
def call(world, address, number):
    call_apart(address, number, world)


@pytest.mark.core
@pytest.mark.nojit
def test_a_kernel_is_called_by_its_address_and_number():
    bench, apart = Bench("patrol"), kernels_apart("test_apart", (mark_first, mark_beyond))
    apart.prepare()
    bench["horizon"][...] = 2
    call(bench.world, apart.address, 0)
    assert bench["pose"][0].tolist() == [bench["target_area"][1], 0.0, 0.0]
    call(bench.world, apart.address, 1)
    assert bench["pose"][0, 1] == bench["target_area"][2] != 0.0


@pytest.mark.core
def test_an_index_out_of_range_is_raised_through_the_call():
    if not mode.CHECKED:
        pytest.skip("runs with NUMBA_BOUNDSCHECK=1")
    bench, apart = Bench("patrol"), kernels_apart("test_apart", (mark_first, mark_beyond))
    apart.prepare()
    bench["horizon"][...] = 9
    with pytest.raises(IndexError):
        call(bench.world, apart.address, 1)


def test_defenses_are_compiled_when_they_are_played(monkeypatch):
    class Unused(DEFENSES["majority"]):
        """A defense that is registered under another name."""

    monkeypatch.setitem(DEFENSES, "unused", Unused)
    trust_env.vector_env("trio", "unused")  # not played
    assert defense_entry(Unused).ready == mode.INTERPRETED
    other = trust_env.vector_env("trio", "score")
    other.reset(seed=0)
    other.step(np.zeros(other.arrays.action.shape))
    assert defense_entry(DEFENSES["score"]).ready and defense_entry(Unused).ready == mode.INTERPRETED
