"""Whatever a scenario may say: no exception, no number that is not finite or out of its range, and no end of time."""

from __future__ import annotations

import faulthandler

import numpy as np
import pytest
from extreme_scenarios import draw_number, draw_scenario, numeric_fields
from extreme_worlds import play

from trust_env.scenario import ScenarioError, load_scenario
from trust_env.spaces.action import ActionTable


@pytest.mark.core
@pytest.mark.parametrize("block", range(6))
def test_scenarios_at_the_ends_of_all_ranges_run(block):
    for seed in range(50 * block, 50 * (block + 1)):
        faulthandler.dump_traceback_later(120, exit=True)  # a kernel without end lets nobody else speak
        rng = np.random.default_rng(seed)
        try:
            play(draw_scenario(rng, most_bytes=4e6, most_pairs=1e6), rng, frames=8)
        except Exception as fault:
            fault.add_note(f"seed {seed}")
            raise
        finally:
            faulthandler.cancel_dump_traceback_later()


@pytest.mark.parametrize(("name", "within"), numeric_fields().items())
def test_every_numeric_field_accepts_its_range_and_nothing_else(name, within):
    rng = np.random.default_rng(1)
    assert all(within.least <= draw_number(rng, within) <= within.most for _ in range(50))
    step = 1 if isinstance(within.most, int) else abs(within.most) * 1e-9
    for outside in (within.least - step, within.most + step, 10**400, -(10**400)):
        with pytest.raises(ScenarioError) as caught:
            load_scenario("patrol", **{name: outside})
        assert any(name in line and f"expected {within}" in line for line in caught.value.problems)


def test_an_action_for_an_fov_without_extent_is_finite():
    """At 1e9 m rounding leaves no height to the box of a narrow sector."""
    table = ActionTable(load_scenario("patrol"))
    action = table.encode(np.array([1e9 - 1, 1e9, 1e9, 1e9]), positions=[[1e9 - 0.5, 1e9]])
    assert table.injections(action)[0].tolist() == [1.0, 0.0, -1.0]
