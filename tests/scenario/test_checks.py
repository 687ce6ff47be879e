"""Values out of bounds, and fields that contradict each other."""

from __future__ import annotations

import pytest

from trust_env.compiled.layout import ACTIONS, ROW, SCRATCH
from trust_env.defenses import build_defense
from trust_env.parameters import Parameters
from trust_env.scenario import load_scenario, scenario_notes
from trust_env.scenario.memory import bytes_by_field


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        (
            {"radius": 0},
            "fov.radius = 0.0 (override): expected a number from 1e-06 to 1e+09, or the FOV sees nothing",
        ),
        ({"type": "sector", "width": 0}, "fov.width = 0.0 (override): expected radians above 0"),
        ({"type": "sector", "width": 90}, "at most 2 pi (6.283185307179586)"),
        ({"type": "polygon"}, "fov.vertices = null (from base.yaml"),
        ({"type": "polygon", "vertices": [[0, 0], [1, 0]]}, "expected at least 3 vertices"),
        ({"type": "polygon", "vertices": [[0, 0], [1, 0], [2, 0]]}, "enclose an area above 0"),
        (
            {"type": "polygon", "vertices": [[0, 0], [0, 0], [1, 0], [0, 1]]},
            "differ from their neighbours",
        ),
        (
            {"type": "polygon", "vertices": [[0, 0], [4, 0], [1, 1], [0, 4]]},
            "corners of a convex polygon",
        ),
        ({"noise_cov": [[-1, 0], [0, -1]]}, "expected a positive definite matrix: variances above 0"),
        (
            {"noise_cov": [[1, 2], [2, 1]]},
            "sensor.noise_cov = [[1.0, 2.0], [2.0, 1.0]] (override): expected a positive",
        ),
        ({"noise_cov": [[1, 1], [1, 1]]}, "expected a positive definite matrix"),
        ({"noise_cov": [[1, 0.5], [0.2, 1]]}, "expected a symmetric matrix"),
        (
            {"noise_cov": [[1, 0, 0], [0, 1, 0]]},
            "noise_cov[0] = [1, 0, 0] (override): expected a list of 2 numbers",
        ),
        ({"noise_cov": [[1, 0], [0, 1]], "sigma": 3}, "expected exactly one of sigma and noise_cov"),
        ({"sigma": None}, "expected exactly one of sigma and noise_cov"),
        ({"sigma": -1}, "sensor.sigma = -1 (override): expected a number from 1e-06 to 1e+09"),
        ({"area": [0, 0, 0, 1]}, "or the area is zero"),
        ({"confirm_m": 6}, "tracker.confirm_m = 6 (override): expected at most confirm_n (5)"),
        ({"confirm_n": 33}, "expected a whole number from 1 to 32"),
        ({"tracker.alpha": 0.5, "beta": 0.5}, "expected alpha + beta below 1"),
        ({"tracker.p_detect": 1}, "tracker.p_detect = 1 (override): expected a number from 1e-15 to below 1"),
        (
            {"clutter_density": 0},
            "expected false positives per m^2 above 0, as the clutter density of agent 0 is 0",
        ),
        (
            {"clutter_density": 1e-3},
            "holds 384.845 false positives on average; expected at most sensor.max_detections",
        ),
        ({"injection.slots": 20}, "expected at least injection.slots (20)"),
        ({"n_adversaries": 0, "n_benign": 0}, "there are 0 agents; expected 1 to 64 in all"),
        ({"n_benign": 63}, "there are 65 agents; expected 1 to 64 in all"),
        ({"agents": []}, "agents (override): there are 0 agents"),
        (
            {"placement": "traffic"},
            "team.placement = 'traffic' (override): expected a recording in targets.data",
        ),
        ({"speed": [3, 1]}, "targets.speed = [3.0, 1.0] (override): expected [min, max] with min <= max"),
        (
            {"positions": [[0, 0]], "velocities": [[1, 1], [2, 2]]},
            "expected one velocity per position (1)",
        ),
        ({"velocities": [[1, 1]]}, "expected one velocity per position (0)"),
        ({"injections": [{"agent": 5, "position": [0, 0]}]}, "expected the index of an agent, 0 to 4"),
        (
            {"injections": [{"agent": 2, "position": [0, 0]}]},
            "at most 0 injections of benign_0, its budget",
        ),
        (
            {"suppressions": [{"agent": 5, "target": 0}], "positions": [[0, 0]]},
            "suppressions[0].agent = 5 (override): expected the index of an agent, 0 to 4",
        ),
        (
            {"suppressions": [{"agent": 0, "target": 1}], "positions": [[0, 0]]},
            "suppressions[0].target = 1 (override): expected the index of one of targets.positions, 0 to 0",
        ),
        ({"suppressions": [{"agent": 0, "target": 0}]}, "expected targets.positions, which this is the index in"),
        (
            {"suppressions": [{"agent": 0, "target": 0}], "positions": [[0, 0]], "suppression.adversary": 0},
            "expected at most 0 suppressions of adversary_0, its budget",
        ),
        (
            {"agents": [{"role": "benign", "fov": {"radius": -1}}]},
            "agents[0].fov.radius = -1.0 (override)",
        ),
        (
            {"agents": [{"role": "benign", "sensor": {"noise_cov": [[1, 3], [3, 1]]}}]},
            "agents[0].sensor.noise_cov = [[1.0, 3.0], [3.0, 1.0]] (override): expected a positive",
        ),
        (
            {"agents": [{"role": "benign", "sensor": {"clutter_density": 1.0}}]},
            "agents[0].sensor.clutter_density = 1.0",
        ),
    ],
)
def test_inconsistent_fields_are_named_with_what_was_expected(
    error_of, overrides: dict[str, object], expected: str
) -> None:
    assert expected in error_of("patrol", **overrides)


def test_everything_that_is_wrong_is_listed_at_once(error_of) -> None:
    """Wrong types, fields that contradict one another within a part, and parts that do; nothing that a default did."""
    found = error_of({
        "dt": -1,
        "horizon": None,
        "area": [1, 0, 0, 1],
        "knowledge": "all",
        "sensor": {"max_detections": 2, "p_detect": 2, "noise_cov": [[1, 2], [2, 1]]},
        "tracker": {"gaet": 1, "confirm_m": 7, "alpha": 0.9, "beta": 0.9},
        "targets": {"speed": [3, 1]},
        "agents": [{"role": "benign", "fov": {"radius": -1}}],
        "injections": [{"agent": 9, "position": [0, 0]}],
        "metrics": 5,
    }).splitlines()  # fmt: skip
    fields = [line.removeprefix("mapping: ").split(" = ")[0] for line in found]
    assert sorted(fields) == sorted([
        "dt", "targets.data", "area", "knowledge", "sensor.max_detections", "sensor.p_detect", "sensor.noise_cov",
        "tracker.gaet", "tracker.confirm_m", "tracker.beta", "targets.speed", "agents[0].fov.radius",
        "injections[0].agent", "metrics",
    ])  # fmt: skip


def test_everything_that_is_wrong_with_several_agents_is_listed_at_once(error_of) -> None:
    """Types and ranges of one entry hide neither the geometry of another nor what is not in the list at all."""
    found = error_of({
        "agents": [
            {"role": "benign", "fov": {"radius": -3}, "sensor": {"p_detect": 3}},
            {"role": "bening", "position": [0], "fov": {"type": "sector", "width": 9}, "belief": {"beta_fp": -1}},
            {"fov": {"type": "polygon", "vertices": [[0, 0], [1, 1], [2, 2]]},
             "sensor": {"sigma": 1, "noise_cov": [[1, 0], [0, 1]]}},
            5,
        ],
        "tracker": {"gate": 2, "confirm_m": 9, "confirm_n": 3},
        "injections": [{"agent": 1, "position": [0, 0]}, {"agent": 7, "position": [0, 0]}],
    }).splitlines()  # fmt: skip
    fields = [line.removeprefix("mapping: ").split(" = ")[0].split(":")[0] for line in found]
    assert sorted(fields) == sorted([
        "agents[0].fov.radius", "agents[0].sensor.p_detect", "agents[1].role", "agents[1].position",
        "agents[1].fov.width", "agents[1].belief.beta_fp", "agents[2].role", "agents[2].fov.vertices",
        "agents[2].sensor.sigma", "agents[3]", "tracker.gate", "tracker.confirm_m", "injections[1].agent",
    ])  # fmt: skip


def test_what_a_default_contradicts_is_not_listed(error_of) -> None:
    """`injection.slots` fits no default of `max_detections`, but that is not what the user wrote."""
    found = error_of({"sensor": {"max_detections": 0}, "injection": {"slots": 20}, "tracker": {"confirm_n": 99}})
    assert [line.split(" = ")[0] for line in found.splitlines()] == [
        "mapping: sensor.max_detections",
        "mapping: tracker.confirm_n",
    ]


def test_what_a_file_sets_without_effect_is_noted(yaml_file) -> None:
    file = yaml_file("base: case1\nteam:\n  n_benign: 4\ntargets: {slots: 3}\n")
    derived = yaml_file("base: my.yaml\ndt: 1\n", "other.yaml")
    load_scenario(file)
    assert scenario_notes(file) == [
        "my.yaml, line 3: team.n_benign = 4: has no effect, as agents decides this",
        "my.yaml, line 4: targets.slots = 3: has no effect, as targets.positions decides this",
    ]
    assert scenario_notes(derived) == scenario_notes("case1") == []


def test_a_heading_that_is_drawn_with_the_position_is_noted(yaml_file) -> None:
    agents = "agents:\n  - {role: adversary, heading: 1.0}\n  - {role: benign, position: [0, 0], heading: 1.0}\n"
    file = yaml_file(f"base: patrol\ndescription: Two.\n{agents}")
    note = "my.yaml, line 4: agents[0].heading = 1.0: has no effect, as team.placement decides this"
    assert scenario_notes(file) == [note]
    together = yaml_file(f"base: patrol\ndescription: Two.\nteam: {{placement: together}}\n{agents}", "other.yaml")
    assert scenario_notes(together) == []


def test_slots_over_a_recording_are_noted(yaml_file, tmp_path, error_of) -> None:
    (tmp_path / "a.csv").write_text("t,id,x,y\n0,a,0,0\n1,a,1,0\n")
    file = yaml_file("horizon: 2\ntargets: {data: a.csv, slots: 5}\n")
    assert load_scenario(file).targets.slots == 1
    assert scenario_notes(file) == ["my.yaml, line 2: targets.slots = 5: has no effect, as targets.data decides this"]
    assert "targets.data decides this here" in error_of(file, **{"targets.slots": 5})


@pytest.mark.parametrize(
    "overrides",
    [
        {},
        {"max_tracks": 4000},
        {"max_local_tracks": 3000},
        {"max_detections": 4000},
        {"targets.slots": 3000, "max_tracks": 3000},
        {"knowledge": "white_box", "coordination": "shared", "max_detections": 300, "n_benign": 20},
        {"n_benign": 60, "max_tracks": 2000, "max_detections": 1000, "knowledge": "white_box"},
    ],
)
def test_the_memory_of_a_world_is_estimated_to_a_third(overrides: dict[str, object]) -> None:
    scenario = load_scenario("patrol", **overrides)
    for defense in ("trust", "majority"):
        sizes = Parameters(scenario, build_defense(defense), 1).layout.sizes
        assert 0.9 < sum(bytes_by_field(scenario).values()) / (sizes[ROW] + sizes[ACTIONS] + sizes[SCRATCH]) < 1.4
