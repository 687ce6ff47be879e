"""Agents of a scenario that differ from the others."""

from __future__ import annotations

import math

import pytest

from trust_env.scenario import load_scenario


def test_agents_differ_only_in_the_fields_they_give() -> None:
    agents = [
        {"role": "benign", "position": [1, 2], "heading": 0.5},
        {
            "role": "adversary",
            "fov": {"type": "sector", "width": math.pi / 2, "radius": 2},
            "sensor": {"noise_cov": [[1, 0], [0, 4]], "clutter_density": 0},
            "belief": {"beta_fp": 1e-5},
            "budget": {"injections": 1},
        },
        {"role": "benign", "fov": {"type": "polygon", "vertices": [[0, 0], [0, 2], [3, 2], [3, 0]]}},
    ]
    scenario = load_scenario("patrol", agents=agents)
    first, second, third = (scenario.agent(k) for k in range(3))
    assert [a.name for a in (first, second, third)] == ["benign_0", "adversary_0", "benign_1"]
    assert (first.position, first.heading) == ((1.0, 2.0), 0.5)
    assert first.fov == scenario.fov
    assert second.fov.area == pytest.approx(math.pi)  # a quarter of 4 pi
    assert second.sensor.covariance == ((1.0, 0.0), (0.0, 4.0))
    assert second.belief.model_dump() == {
        "p_detect": 0.9,
        "beta_fp": 1e-5,
        "beta_nt": pytest.approx(1e-8),
        "compromised": None,
    }
    assert second.budget.model_dump() == {"injections": 1, "suppressions": 16}
    assert third.fov.area == 6.0
    assert load_scenario(scenario, sigma=2).agent(0).sensor.sigma == 2.0


def test_platform_types_are_those_of_the_entries_or_of_the_team() -> None:
    team = load_scenario("trio", platforms=["ship", "plane", "ship"])
    assert team.platforms == (0, 1, 0) and team.agent(2).platform == "ship"
    listed = load_scenario("trio", agents=[{"role": "benign", "platform": "plane"}, {"role": "adversary"}])
    assert listed.platforms == (0, -1) and listed.agent(1).platform is None
    with pytest.raises(ValueError, match=r"team\.platforms.*one platform type for each of the 3 agents; there are 2"):
        load_scenario("trio", platforms=["ship", "plane"])
