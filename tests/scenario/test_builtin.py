"""Built-in scenarios: their numbers, and the paper's cases as the authors have them."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import yaml
from paths import REFERENCE

from trust_env.scenario import Scenario, load_scenario, scenarios

SIMULATED = [name for name in scenarios() if name != "skies"]


def test_there_are_nine_of_them() -> None:
    paper = ("case1", "case1_fn", "case2", "case2_fn")
    assert scenarios() == (*paper, "crowd", "patrol", "skies", "theorem", "trio")


@pytest.mark.parametrize("name", SIMULATED)
def test_each_is_read_back_from_its_own_yaml(name: str, yaml_file) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.recording() is None
    assert load_scenario(yaml_file(scenario.to_yaml())) == scenario


def test_patrol_has_the_numbers_of_the_design() -> None:
    patrol = load_scenario("patrol")
    assert patrol.agent_names == ("adversary_0", "adversary_1", "benign_0", "benign_1", "benign_2")
    assert (patrol.horizon, patrol.dt, patrol.tracker.max_tracks) == (200, 1.0, 64)
    agent = patrol.agent(2)
    assert agent.position is None  # drawn at every reset
    assert agent.fov.area == pytest.approx(math.pi * 350**2)
    assert agent.sensor.covariance == ((25.0, 0.0), (0.0, 25.0))
    assert agent.belief.model_dump(exclude_none=True) == {"p_detect": 0.9, "beta_fp": 1e-6, "beta_nt": 1e-9}
    assert agent.budget.model_dump() == {"injections": 0, "suppressions": 16}
    assert patrol.agent(0).budget.model_dump() == {"injections": 4, "suppressions": 16}


def test_case1_and_case2_have_the_numbers_of_the_paper() -> None:
    case1, case2 = load_scenario("case1"), load_scenario("case2")
    assert case1.agent_names == ("adversary_0", "benign_0", "adversary_1")
    assert case2.agent_names == ("benign_0", "benign_1", "adversary_0")
    for case in (case1, case2):
        assert [case.agent(k).position for k in range(3)] == [(0, 0), (1, 0), (0.5, 0.8660254037844386)]
        assert (case.fov.radius, case.dt, case.horizon, case.targets.slots) == (0.95, 0.1, 20, 4)
        assert (case.sensor.p_detect, case.sensor.sigma, case.tracker.p_detect) == (1.0, 0.005, 0.9)
        assert case.agent(0).belief.beta_nt == pytest.approx(1e-9)
    assert [(i.agent, i.position[0]) for i in case1.injections] == [
        (0, 0.25570811752957345),
        (2, 0.6230178106527222),
    ]
    assert [i.agent for i in case2.injections] == [2, 2]
    assert case2.targets.positions is not None
    assert case2.targets.positions[1] == (1.3526702701183513, 1.283206876555528)


@pytest.mark.parametrize("name", ["case1", "case2"])
def test_case1_and_case2_equal_those_of_the_authors(name: str) -> None:
    reference = json.loads((REFERENCE / "cdc2024_cases.json").read_text())
    case, theirs = load_scenario(name), reference["cases"][f"{name}_no_prior"]
    assert [list(case.agent(k).position or ()) for k in range(3)] == theirs["agent_positions"]
    assert [list(p) for p in case.targets.positions or ()] == theirs["true_objects"]
    injections = [{"agent": i.agent, "position": list(i.position)} for i in case.injections]
    assert injections == theirs["false_positives"]
    assert {i.agent for i in case.injections} == {k for k, r in enumerate(case.roles) if r == "adversary"}
    assert (case.fov.radius, case.dt, case.horizon) == tuple(reference[key] for key in ("fov_radius", "dt", "frames"))


def test_false_positives_of_the_cases_lie_in_the_fov_of_their_agent() -> None:
    for case in (load_scenario("case1"), load_scenario("case2")):
        for injection in case.injections:
            assert math.dist(injection.position, case.agent(injection.agent).position or ()) < 0.95


@pytest.mark.parametrize("name", ["case1", "case2"])
def test_suppressions_stand_in_the_place_of_the_injections(name: str) -> None:
    """The agents that injected a false positive keep silent about a target at its position; the rest is the same."""
    case, silent = load_scenario(name), load_scenario(f"{name}_fn")
    positions = silent.targets.positions or ()
    assert [(s.agent, positions[s.target]) for s in silent.suppressions] == [
        (i.agent, i.position) for i in case.injections
    ]
    assert positions[:4] == case.targets.positions and silent.injections == ()
    assert silent.agents == case.agents and silent.tracker == case.tracker and silent.sensor == case.sensor


def test_theorem_has_noise_of_determinant_five_and_any_number_of_agents() -> None:
    theorem = load_scenario("theorem(n_adversaries=2, n_benign=3, order=adversaries_last)")
    assert theorem.roles == ("benign", "benign", "benign", "adversary", "adversary")
    assert np.linalg.det(theorem.sensor.covariance) == pytest.approx(5.0)
    assert {theorem.agent(k).position for k in range(5)} == {(0.0, 0.0)}
    assert theorem.targets.slots == 0
    assert theorem.sensor.sigma is None


def test_trio_and_crowd_have_the_sizes_of_the_design() -> None:
    trio, crowd = load_scenario("trio"), load_scenario("crowd")
    assert (trio.roles.count("adversary"), trio.n_agents) == (1, 3)
    assert (crowd.roles.count("adversary"), crowd.n_agents) == (4, 16)
    sizes = (trio.sensor.max_detections, trio.injection.slots, trio.tracker.max_tracks)
    assert (*sizes, trio.tracker.max_local_tracks, trio.horizon) == (12, 2, 32, 16, 100)


def test_the_yaml_is_readable() -> None:
    text = load_scenario("case1").to_yaml()
    assert "area: [-1.0, 2.0, -1.0, 2.0]" in text
    assert yaml.safe_load(text)["tracker"]["beta_fp"] == 1e-6


def test_every_default_stands_in_base_yaml_alone() -> None:
    def missing(model: type) -> list[str]:
        fields = model.model_fields  # type: ignore[attr-defined]
        nested = [f for f in fields.values() if hasattr(f.annotation, "model_fields")]
        inner = [name for f in nested for name in missing(f.annotation)]  # type: ignore[arg-type]
        return [n for n, f in fields.items() if not f.is_required()] + inner

    assert missing(Scenario) == []
