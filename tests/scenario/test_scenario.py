"""Scenarios: what is built in, how they are put together, and what every mistake is answered with."""

from __future__ import annotations

import copy
import json
import math
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from paths import REFERENCE, ROOT, TRAFFIC

from trust_env.scenario import Scenario, ScenarioError, load_scenario, scenario_fields, scenarios

SIMULATED = [name for name in scenarios() if name != "skies"]


def complaint(source: object = "patrol", /, **overrides: object) -> str:
    with pytest.raises(ScenarioError) as caught:
        load_scenario(source, **overrides)  # type: ignore[arg-type]
    return str(caught.value)


@pytest.fixture
def yaml_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)

    def write(text: str, name: str = "my.yaml") -> str:
        (tmp_path / name).write_text(text)
        return name

    return write


class TestBuiltIn:
    def test_names(self) -> None:
        assert scenarios() == ("case1", "case2", "crowd", "patrol", "skies", "theorem", "trio")

    @pytest.mark.parametrize("name", SIMULATED)
    def test_all_load_and_survive_their_own_yaml(self, name: str, yaml_file) -> None:
        scenario = load_scenario(name)
        assert scenario.name == name
        assert scenario.recording() is None
        assert load_scenario(yaml_file(scenario.to_yaml())) == scenario

    def test_patrol(self) -> None:
        patrol = load_scenario("patrol")
        assert patrol.agent_names == ("adversary_0", "adversary_1", "benign_0", "benign_1", "benign_2")
        assert (patrol.horizon, patrol.dt, patrol.tracker.max_tracks) == (200, 1.0, 64)
        agent = patrol.agent(2)
        assert agent.position is None  # drawn at every reset
        assert agent.fov.area == pytest.approx(math.pi * 350**2)
        assert agent.sensor.covariance == ((25.0, 0.0), (0.0, 25.0))
        assert agent.belief.model_dump() == {"p_detect": 0.9, "beta_fp": 1e-6, "beta_nt": 1e-9}
        assert agent.budget.model_dump() == {"injections": 0, "suppressions": 16}
        assert patrol.agent(0).budget.model_dump() == {"injections": 4, "suppressions": 16}

    def test_the_paper_s_cases(self) -> None:
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
    def test_the_cases_are_those_of_the_authors(self, name: str) -> None:
        reference = json.loads((REFERENCE / "cdc2024_cases.json").read_text())
        case, theirs = load_scenario(name), reference["cases"][f"{name}_no_prior"]
        assert [list(case.agent(k).position or ()) for k in range(3)] == theirs["agent_positions"]
        assert [list(p) for p in case.targets.positions or ()] == theirs["true_objects"]
        injections = [{"agent": i.agent, "position": list(i.position)} for i in case.injections]
        assert injections == theirs["false_positives"]
        assert {i.agent for i in case.injections} == {k for k, r in enumerate(case.roles) if r == "adversary"}
        assert (case.fov.radius, case.dt, case.horizon) == tuple(
            reference[key] for key in ("fov_radius", "dt", "frames")
        )

    def test_false_positives_of_the_cases_lie_in_their_agents_fov(self) -> None:
        for case in (load_scenario("case1"), load_scenario("case2")):
            for injection in case.injections:
                assert math.dist(injection.position, case.agent(injection.agent).position or ()) < 0.95

    def test_theorem_has_noise_of_determinant_five_and_any_number_of_agents(self) -> None:
        theorem = load_scenario("theorem(n_adversaries=2, n_benign=3, order=adversaries_last)")
        assert theorem.roles == ("benign", "benign", "benign", "adversary", "adversary")
        assert np.linalg.det(theorem.sensor.covariance) == pytest.approx(5.0)
        assert {theorem.agent(k).position for k in range(5)} == {(0.0, 0.0)}
        assert theorem.targets.slots == 0
        assert theorem.sensor.sigma is None

    def test_the_small_and_the_large_one(self) -> None:
        trio, crowd = load_scenario("trio"), load_scenario("crowd")
        assert (trio.roles.count("adversary"), trio.n_agents) == (1, 3)
        assert (crowd.roles.count("adversary"), crowd.n_agents) == (4, 16)
        sizes = (trio.sensor.max_detections, trio.injection.slots, trio.tracker.max_tracks)
        assert (*sizes, trio.tracker.max_local_tracks, trio.horizon) == (12, 2, 32, 16, 100)


class TestSkies:
    def test_says_how_to_give_the_recording(self) -> None:
        text = complaint("skies")
        assert text.startswith("skies: targets.data = null")
        assert "a recording decides horizon, area, targets.slots" in text
        assert 'load_scenario("skies", data="traffic.csv")' in text
        assert "skies(data='traffic.csv')" in text
        assert scenario_fields("skies")["description"].startswith("Recorded air traffic")

    @pytest.mark.skipif(not TRAFFIC.exists(), reason="the recording of UK traffic is not here")
    def test_the_recording_decides_what_is_null(self) -> None:
        skies = load_scenario("skies", data=TRAFFIC)
        recording = skies.recording()
        assert recording is not None
        assert recording is skies.recording()
        assert (skies.horizon, skies.targets.slots, skies.dt) == (121, 83, 10.0)
        assert skies.area == recording.area
        assert (skies.tracker.process_noise, skies.tracker.initial_velocity_variance) == (25.0, 22500.0)
        centres = np.array([skies.agent(k).position for k in range(5)])
        assert len(np.unique(centres, axis=0)) == 5
        # k-means: each centre is the mean of the positions nearest to it
        points = recording.positions[~np.isnan(recording.positions[..., 0])]
        members = np.linalg.norm(points[:, None] - centres, axis=-1).argmin(axis=1)
        means = [points[members == k].mean(axis=0) for k in range(5)]
        np.testing.assert_allclose(means, centres, atol=2e3)
        assert sorted(np.bincount(members), reverse=True) == np.bincount(members).tolist()
        assert "at most 121, the frames of the recording" in complaint(skies, horizon=122)
        assert load_scenario(skies, horizon=50).horizon == 50

    def test_paths_are_relative_to_the_file_that_names_them(self, yaml_file, tmp_path: Path) -> None:
        (tmp_path / "sub").mkdir()
        rows = "t,id,x,y\n0,a,0,0\n10,a,100,0\n20,a,200,0\n0,b,0,5000\n20,b,50,5000\n"
        (tmp_path / "sub" / "traffic.csv").write_text(rows)
        yaml_file("base: skies\ntargets: {data: traffic.csv}\nteam: {n_benign: 1}\n", "sub/mine.yaml")
        mine = load_scenario("sub/mine.yaml")
        assert (mine.name, mine.horizon, mine.targets.slots) == ("mine", 3, 2)
        assert mine.area == (0.0, 200.0, 0.0, 5000.0)
        derived = load_scenario(yaml_file("base: sub/mine.yaml\nhorizon: 2\n"))
        assert (derived.targets.data, derived.horizon) == (mine.targets.data, 2)
        override = load_scenario("skies(data='sub/traffic.csv', n_benign=1)")
        assert override.targets.data == str((tmp_path / "sub" / "traffic.csv").resolve())
        text = complaint(derived, n_benign=50, horizon=2)
        assert "expected a recording of at least 52 different positions" in text

    def test_a_broken_recording_is_named_with_its_line(self, yaml_file, tmp_path: Path) -> None:
        (tmp_path / "bad.csv").write_text("t,id,x,y\n0,a,0,zero\n")
        text = complaint(yaml_file("base: skies\ntargets:\n  data: bad.csv\n"))
        assert text.startswith(f"my.yaml, line 3: targets.data = '{tmp_path.resolve()}/bad.csv': ")
        assert "bad.csv, line 2: y = 'zero': expected a finite number" in text
        assert "there is no such file" in complaint("skies", data="nowhere.csv")


class TestSources:
    def test_all_forms_agree(self, yaml_file) -> None:
        expected = load_scenario("patrol", horizon=50)
        assert expected.horizon == 50
        assert load_scenario("patrol(horizon=50)") == expected
        assert load_scenario({"base": "patrol", "horizon": 50}) == expected
        assert load_scenario({"base": "patrol(horizon=50)"}) == expected
        assert load_scenario(expected) == expected
        file = yaml_file("base: patrol\nhorizon: 50\nname: patrol\n")
        assert load_scenario(file) == load_scenario(Path(file)) == expected
        assert load_scenario(f"{file}(horizon=7)").horizon == 7

    def test_mappings_merge_and_lists_replace(self, yaml_file) -> None:
        file = yaml_file(
            "sensor: {noise_cov: [[4, 1], [1, 9]]}\narea: [0, 1, 0, 2]\n"
            "tracker: {beta_nt: 1e-8, beta: 1.5e-2}\n"
        )
        mine, base = load_scenario(file), load_scenario("patrol")
        assert mine.name == "my"
        assert mine.sensor.covariance == ((4.0, 1.0), (1.0, 9.0))
        assert (mine.sensor.sigma, mine.sensor.p_detect) == (None, base.sensor.p_detect)
        assert mine.area == (0.0, 1.0, 0.0, 2.0)
        assert (mine.tracker.beta_nt, mine.tracker.beta, mine.tracker.gate) == (1e-8, 0.015, 0.99)

    def test_overrides_by_dotted_and_by_last_name(self) -> None:
        scenario = load_scenario(
            "patrol", **{"tracker.p_detect": 0.8}, gate=np.float64(0.95), radius=np.int64(9)
        )
        assert (scenario.tracker.p_detect, scenario.tracker.gate, scenario.fov.radius) == (0.8, 0.95, 9.0)
        assert scenario.sensor.p_detect == 0.9
        assert load_scenario("patrol(tracker.gate=0.9)").tracker.gate == 0.9
        assert load_scenario("patrol", tracker={"gate": 0.9}).tracker.alpha == 1e-4
        assert load_scenario("patrol", order="adversaries_last").roles[0] == "benign"
        assert load_scenario("patrol", order=1).metrics.order == 1.0
        assert load_scenario("theorem", sigma=2.0).agent(0).sensor.covariance == ((4.0, 0.0), (0.0, 4.0))

    def test_agents_differ_where_they_say_so(self) -> None:
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
        }
        assert second.budget.model_dump() == {"injections": 1, "suppressions": 16}
        assert third.fov.area == 6.0
        assert load_scenario(scenario, sigma=2).agent(0).sensor.sigma == 2.0

    def test_fixed_positions_decide_the_slots(self) -> None:
        scenario = load_scenario("patrol", positions=[[0, 0], [1, 1]], velocities=[[1, 0], [0, 1]])
        assert scenario.targets.slots == 2

    def test_a_scenario_is_a_value(self) -> None:
        scenario = load_scenario("case1")
        assert pickle.loads(pickle.dumps(scenario)) == copy.deepcopy(scenario) == scenario
        assert hash(scenario) == hash(load_scenario("case1"))
        with pytest.raises(ValueError, match="frozen"):
            scenario.dt = 2.0  # type: ignore[misc]

    def test_every_default_stands_in_base_yaml_alone(self) -> None:
        def missing(model: type) -> list[str]:
            fields = model.model_fields  # type: ignore[attr-defined]
            nested = [f for f in fields.values() if hasattr(f.annotation, "model_fields")]
            inner = [name for f in nested for name in missing(f.annotation)]  # type: ignore[arg-type]
            return [n for n, f in fields.items() if not f.is_required()] + inner

        assert missing(Scenario) == []

    def test_importing_it_is_light(self) -> None:
        code = "import sys, trust_env.scenario; print(*{'pyproj', 'pyarrow', 'torch'} & sys.modules.keys())"
        root = ROOT
        found = subprocess.run(
            [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True
        )
        assert found.stdout.strip() == ""


class TestErrorsInFiles:
    def test_each_names_file_line_field_value_and_expectation(self, yaml_file) -> None:
        text = complaint(
            yaml_file(
                "base: patrol\ntracker:\n  gaet: 0.9\n  gate: 1.5\n  alpha: .nan\nknowledge: poess\n"
                "horizon: 3.5\nsensor: {p_detect: yes, sigma: '5'}\nfov: null\narea: [0, 1, 2]\n"
                "agents:\n  - {rol: benign}\n  - {role: benign, position: [1]}\ndt: .inf\ninjections: 4\n"
            )
        )
        lines = text.splitlines()
        assert "my.yaml, line 4: tracker.gate = 1.5: expected a number below 1" in lines
        assert "my.yaml, line 5: tracker.alpha = nan: expected a finite number" in lines
        assert "my.yaml, line 7: horizon = 3.5: expected a whole number" in lines
        assert "my.yaml, line 8: sensor.p_detect = True: expected a number" in lines
        assert "my.yaml, line 8: sensor.sigma = '5': expected a number" in lines
        assert "my.yaml, line 9: fov = null: expected a mapping of fields" in lines
        area = "my.yaml, line 10: area = [0, 1, 2]: expected a list of 4 numbers [x_min, x_max, y_min, y_max]"
        assert area in lines
        assert "my.yaml, line 12: agents[0].role: this field is required" in lines
        assert "my.yaml, line 13: agents[1].position = [1]: expected a list of 2 numbers [x, y]" in lines
        assert "my.yaml, line 14: dt = inf: expected a finite number" in lines
        assert "my.yaml, line 15: injections = 4: expected a list" in lines
        knowledge = "my.yaml, line 6: knowledge = 'poess': did you mean 'poses'? expected one of own, poses,"
        assert f"{knowledge} picture, white_box" in lines
        unknown = (
            "my.yaml, line 3: tracker.gaet = 0.9: unknown field; did you mean 'gate'? expected one of p_"
        )
        assert any(line.startswith(unknown) for line in lines)
        assert any(
            line.startswith("my.yaml, line 12: agents[0].rol = 'benign': unknown field") for line in lines
        )
        assert len(lines) == 14

    @pytest.mark.parametrize(
        ("text", "expected"),
        [
            ("dt: [1\nx: 2\n", "my.yaml, line 2, column 2: not valid YAML: expected ',' or ']'"),
            ("dt: 1\n\tx: 2", "my.yaml, line 2, column 1: not valid YAML: found character '\\t'"),
            ("dt: 1\ndt: 2\n", "my.yaml, line 2: dt is given twice (first in line 1)"),
            ("- 1\n", "expected a mapping of fields such as `base: patrol`, found a list"),
            ("patrol\n", "found a single value"),
            ("", "found nothing"),
            ("a: &x [*x]\n", "an alias contains itself"),
            ("on: 1\n", "my.yaml, line 1: expected the name of a field, found on"),
            ("[1]: 1\n", "found a list or a mapping"),
            (
                "dt: !!python/name:os.system 1\n",
                "my.yaml, line 1, column 5: not valid YAML: could not determine",
            ),
            ("dt: 2001-99-99\n", "my.yaml: not valid YAML: month must be in 1..12"),
            ("dt: \x00\n", "my.yaml: not valid YAML: unacceptable character"),
            ("base: 3\n", "my.yaml, line 1: base = 3: expected the name of a scenario"),
            ("base: patroll\n", "unknown scenario 'patroll'; did you mean 'patrol'?"),
            ("dt: 1\nbase: none.yaml\n", "my.yaml, line 2: base: none.yaml: there is no such file"),
        ],
    )
    def test_broken_files(self, yaml_file, text: str, expected: str) -> None:
        found = complaint(yaml_file(text))
        assert expected in found
        assert found.startswith("my.yaml")

    def test_bases_in_a_circle(self, yaml_file) -> None:
        yaml_file("base: my.yaml\n", "other.yaml")
        assert "in a circle: my.yaml -> other.yaml -> my.yaml" in complaint(yaml_file("base: other.yaml\n"))

    def test_a_value_from_a_base_is_found_there(self, yaml_file) -> None:
        yaml_file("dt: 1\ntracker:\n  gate: 7\n", "other.yaml")
        text = complaint(yaml_file("base: other.yaml\ntracker: {alpha: 2}\n"))
        assert "my.yaml: tracker.gate = 7 (from other.yaml, line 3): expected a number below 1" in text
        assert "my.yaml, line 2: tracker.alpha = 2: expected a number below 1" in text
        text = complaint(yaml_file("injection:\n  slots: 20\n"))
        assert text.startswith("my.yaml: sensor.max_detections = 16 (from base.yaml, line ")
        assert text.endswith("): expected at least injection.slots (20)")

    def test_files_that_cannot_be_read(self, tmp_path: Path) -> None:
        assert "none.yaml: there is no such file" in complaint(tmp_path / "none.yaml")
        (tmp_path / "enc.yaml").write_bytes(b"dt: \xff")
        assert "expected a YAML file in UTF-8" in complaint(tmp_path / "enc.yaml")


class TestErrorsInOverrides:
    @pytest.mark.parametrize(
        ("source", "expected"),
        [
            (
                "patroll",
                "unknown scenario 'patroll'; did you mean 'patrol'? known: case1, case2, crowd, patrol",
            ),
            ("patrol(gaet=1)", "patrol: gaet = 1 (override): unknown field; did you mean 'tracker.gate'?"),
            ("patrol(tracker.gaet=1)", "unknown field; did you mean 'tracker.gate'?"),
            (
                "patrol(p_detect=1)",
                "several fields have this name; expected one of sensor.p_detect, tracker.p_detect",
            ),
            ("patrol(gate=2)", "patrol: tracker.gate = 2 (override): expected a number below 1"),
            ("patrol(gate=nan)", "patrol: tracker.gate = 'nan' (override): expected a number"),
            (
                "patrol(order=x)",
                "team.order = 'x' (override): expected one of adversaries_first, adversaries_last",
            ),
            ("patrol(horizon=0)", "horizon = 0 (override): expected a number of at least 1"),
            ("patrol(horizon=None)", "targets.data = null"),
            ("patrol(evidence=5)", "evidence = 5 (override): expected a mapping of fields"),
            ("patrol(9)", "'9' has no name; expected key=value"),
            ("case1(n_benign=3)", "case1: team.n_benign = 3 (override): agents decides this here"),
            ("case1(targets.slots=3)", "targets.slots = 3 (override): targets.positions decides this here"),
            ("patrol.txt", "a file's name ends in .yaml"),
        ],
    )
    def test_are_named(self, source: str, expected: str) -> None:
        assert expected in complaint(source)

    def test_all_are_listed_at_once(self) -> None:
        with pytest.raises(ScenarioError) as caught:
            load_scenario("patrol", foo=1, bar=2)
        assert len(caught.value.problems) == 2
        assert pickle.loads(pickle.dumps(caught.value)).problems == caught.value.problems
        assert isinstance(caught.value, ValueError)

    def test_sources_of_other_kinds(self) -> None:
        assert "3: expected a scenario's name, a path ending in .yaml or a mapping" in complaint(3)
        assert "mapping: fov.radius = -1.0: expected a number above 0" in complaint({"fov": {"radius": -1}})
        assert "expected the name of a field" in complaint({1: 2})


class TestBetweenFields:
    @pytest.mark.parametrize(
        ("overrides", "expected"),
        [
            (
                {"radius": 0},
                "fov.radius = 0.0 (override): expected a number above 0, or the FOV sees nothing",
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
            ({"sigma": -1}, "sensor.sigma = -1 (override): expected a number above 0"),
            ({"area": [0, 0, 0, 1]}, "or the area is zero"),
            ({"confirm_m": 6}, "tracker.confirm_m = 6 (override): expected at most confirm_n (5)"),
            ({"confirm_n": 33}, "expected a number of at most 32"),
            ({"tracker.alpha": 0.5, "beta": 0.5}, "expected alpha + beta below 1"),
            ({"tracker.p_detect": 1}, "tracker.p_detect = 1 (override): expected a number below 1"),
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
            ({"n_benign": 70}, "there are 72 agents; expected 1 to 64 in all"),
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
    def test_patrol_refuses(self, overrides: dict[str, object], expected: str) -> None:
        assert expected in complaint("patrol", **overrides)

    def test_a_star_is_no_convex_polygon(self) -> None:
        star = [[math.cos(a), math.sin(a)] for a in np.arange(5) * 4 * math.pi / 5]
        assert "corners of a convex polygon" in complaint("patrol", type="polygon", vertices=star)
        convex = [[math.cos(a), math.sin(a)] for a in np.arange(5) * -2 * math.pi / 5]
        scenario = load_scenario("patrol", type="polygon", vertices=convex)
        assert scenario.fov.area == pytest.approx(2.5 * math.sin(2 * math.pi / 5))

    def test_positions_and_a_recording_exclude_each_other(self, yaml_file, tmp_path: Path) -> None:
        (tmp_path / "a.csv").write_text("t,id,x,y\n0,a,0,0\n1,a,1,0\n")
        text = complaint(yaml_file("horizon: 2\ntargets: {data: a.csv, positions: [[0, 0]]}\n"))
        assert "targets.data" in text
        assert "expected null, as positions are given" in text


def test_the_yaml_is_readable() -> None:
    text = load_scenario("case1").to_yaml()
    assert "area: [-1.0, 2.0, -1.0, 2.0]" in text
    assert yaml.safe_load(text)["tracker"]["beta_fp"] == 1e-6
