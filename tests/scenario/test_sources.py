"""Sources: names, files, mappings and scenarios, the bases they build on, and files that are broken."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from pathlib import Path

import pytest
from paths import ROOT

from trust_env.scenario import load_scenario


def test_all_forms_of_a_source_give_the_same_scenario(yaml_file) -> None:
    expected = load_scenario("patrol", horizon=50)
    assert expected.horizon == 50
    assert load_scenario("patrol(horizon=50)") == expected
    assert load_scenario({"base": "patrol", "horizon": 50}) == expected
    assert load_scenario({"base": "patrol(horizon=50)"}) == expected
    assert load_scenario(expected) == expected
    file = yaml_file("base: patrol\nhorizon: 50\nname: patrol\n")
    assert load_scenario(file) == load_scenario(Path(file)) == expected
    assert load_scenario(f"{file}(horizon=7)").horizon == 7


def test_mappings_merge_and_lists_replace(yaml_file) -> None:
    file = yaml_file(
        "sensor: {noise_cov: [[4, 1], [1, 9]]}\narea: [0, 1, 0, 2]\ntracker: {beta_nt: 1e-8, beta: 1.5e-2}\n"
    )
    mine, base = load_scenario(file), load_scenario("patrol")
    assert mine.name == "my"
    assert mine.sensor.covariance == ((4.0, 1.0), (1.0, 9.0))
    assert (mine.sensor.sigma, mine.sensor.p_detect) == (None, base.sensor.p_detect)
    assert mine.area == (0.0, 1.0, 0.0, 2.0)
    assert (mine.tracker.beta_nt, mine.tracker.beta, mine.tracker.gate) == (1e-8, 0.015, 0.99)


def test_scenarios_are_frozen_and_equal_by_value() -> None:
    scenario = load_scenario("case1")
    assert pickle.loads(pickle.dumps(scenario)) == copy.deepcopy(scenario) == scenario
    assert hash(scenario) == hash(load_scenario("case1"))
    with pytest.raises(ValueError, match="frozen"):
        scenario.dt = 2.0  # type: ignore[misc]


def test_importing_scenarios_imports_no_heavy_library() -> None:
    code = "import sys, trust_env.scenario; print(*{'pyproj', 'pyarrow', 'torch'} & sys.modules.keys())"
    root = ROOT
    found = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == ""


def test_errors_name_file_line_field_value_and_expectation(error_of, yaml_file) -> None:
    text = error_of(
        yaml_file(
            "base: patrol\ntracker:\n  gaet: 0.9\n  gate: 1.5\n  alpha: .nan\nknowledge: poess\n"
            "horizon: 3.5\nsensor: {p_detect: yes, sigma: '5'}\nfov: null\narea: [0, 1, 2]\n"
            "agents:\n  - {rol: benign}\n  - {role: benign, position: [1]}\ndt: .inf\ninjections: 4\n"
        )
    )
    lines = text.splitlines()
    assert "my.yaml, line 4: tracker.gate = 1.5: expected a number from 1e-15 to below 1" in lines
    assert "my.yaml, line 5: tracker.alpha = nan: expected a number from 1e-15 to below 1" in lines
    assert "my.yaml, line 7: horizon = 3.5: expected a whole number" in lines
    assert "my.yaml, line 8: sensor.p_detect = True: expected a number" in lines
    assert "my.yaml, line 8: sensor.sigma = '5': expected a number" in lines
    assert "my.yaml, line 9: fov = null: expected a mapping of fields" in lines
    area = "my.yaml, line 10: area = [0, 1, 2]: expected a list of 4 numbers [x_min, x_max, y_min, y_max]"
    assert area in lines
    assert "my.yaml, line 12: agents[0].role: this field is required" in lines
    assert "my.yaml, line 13: agents[1].position = [1]: expected a list of 2 numbers [x, y]" in lines
    assert "my.yaml, line 14: dt = inf: expected a number from 1e-06 to 1e+06" in lines
    assert "my.yaml, line 15: injections = 4: expected a list" in lines
    knowledge = "my.yaml, line 6: knowledge = 'poess': did you mean 'poses'? expected one of own, poses,"
    assert f"{knowledge} picture, white_box" in lines
    unknown = "my.yaml, line 3: tracker.gaet = 0.9: unknown field; did you mean 'gate'? expected one of p_"
    assert any(line.startswith(unknown) for line in lines)
    assert any(line.startswith("my.yaml, line 12: agents[0].rol = 'benign': unknown field") for line in lines)
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
def test_broken_files_are_named_with_the_line(error_of, yaml_file, text: str, expected: str) -> None:
    found = error_of(yaml_file(text))
    assert expected in found
    assert found.startswith("my.yaml")


def test_files_that_name_each_other_as_base_are_an_error(error_of, yaml_file) -> None:
    yaml_file("base: my.yaml\n", "other.yaml")
    assert "in a circle: my.yaml -> other.yaml -> my.yaml" in error_of(yaml_file("base: other.yaml\n"))


def test_errors_name_the_base_that_a_value_comes_from(error_of, yaml_file) -> None:
    yaml_file("dt: 1\ntracker:\n  gate: 7\n", "other.yaml")
    text = error_of(yaml_file("base: other.yaml\ntracker: {alpha: 2}\n"))
    assert "my.yaml: tracker.gate = 7 (from other.yaml, line 3): expected a number from 1e-15 to below 1" in text
    assert "my.yaml, line 2: tracker.alpha = 2: expected a number from 1e-15 to below 1" in text
    text = error_of(yaml_file("injection:\n  slots: 20\n"))
    assert text.startswith("my.yaml: sensor.max_detections = 16 (from base.yaml, line ")
    assert text.endswith("): expected at least injection.slots (20)")


def test_files_that_cannot_be_read_are_an_error(error_of, tmp_path: Path) -> None:
    assert "none.yaml: there is no such file" in error_of(tmp_path / "none.yaml")
    (tmp_path / "enc.yaml").write_bytes(b"dt: \xff")
    assert "expected a YAML file in UTF-8" in error_of(tmp_path / "enc.yaml")


def test_sources_of_other_kinds_are_an_error(error_of) -> None:
    assert "3: expected a scenario's name, a path ending in .yaml or a mapping" in error_of(3)
    assert "mapping: fov.radius = -1.0: expected a number from 1e-06 to 1e+09" in error_of({"fov": {"radius": -1}})
    assert "expected the name of a field" in error_of({1: 2})
