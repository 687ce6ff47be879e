"""Files, mappings and specs from strangers: a short error that names what is wrong, before they take time or memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from trust_env.defenses import build_defense
from trust_env.scenario import ScenarioError, load_scenario
from trust_env.scenario.recording import read_recording

SHORT = 1000  # characters
MEGABYTES = 200
_LOAD = """
import json, resource, sys
from trust_env.scenario import ScenarioError, load_scenario
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024 if sys.platform == "linux" else 1024**2)
before, text = peak(), ""
try:
    load_scenario(sys.argv[1])
except ScenarioError as error:
    text = str(error)
print(json.dumps([text, peak() - before]))
"""


def alias_bomb() -> str:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    return "\n".join(lines)


def merge_bomb() -> str:
    lines = ["a0: &a0 {x: 1}"]
    lines += [f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 10)}]}}" for i in range(1, 12)]
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("team: {n_benign: 1000000000}", "team.n_benign = 1000000000: expected a whole number from 0 to 64"),
        ("targets: {slots: 1000000000}", "targets.slots = 1000000000: expected a whole number from 0 to 65536"),
        ("tracker: {max_tracks: 65536, max_local_tracks: 65536}", "max_local_tracks 65536); expected at most 2 GB"),
        (alias_bomb(), "more than 50000 entries, aliases repeated"),
        (merge_bomb(), "more than 50000 entries, aliases repeated"),
        ("a: " + "[" * 5000, "my.yaml, line 1: nested deeper than 20 levels"),
        ("".join("  " * i + f"a{i}:\n" for i in range(400)), "nested deeper than 20 levels"),
        ("a: " + "1" * 500_000 + "e", "unknown field"),
        ("#" * 2_000_000, "my.yaml: expected a file of at most 1000000 characters"),
    ],
    ids=["agents", "targets", "tracks", "aliases", "merges", "brackets", "levels", "digits", "size"],
)
def test_what_would_take_all_memory_is_refused_before_it_does(yaml_file, text: str, expected: str) -> None:
    command = [sys.executable, "-c", _LOAD, yaml_file(text)]
    found, megabytes = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert expected in found
    assert len(found) < SHORT
    assert megabytes < MEGABYTES


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        (
            {"max_detections": 2**62},
            f"sensor.max_detections = {2**62} (override): expected a whole number from 1",
        ),
        ({"max_detections": 10**9}, "sensor.max_detections = 1000000000 (override): expected a whole number from 1"),
        ({"max_tracks": 2**32}, "tracker.max_tracks = 4294967296 (override): expected a whole number from 1 to 65536"),
        ({"max_unseen": 10**23}, f"tracker.max_unseen = {10**23} (override): expected a whole number from 1 to 10000"),
        ({"horizon": 10**5000}, "horizon = a number of more than 4300 digits (override): expected a whole number"),
        ({"sigma": 1e200}, "sensor.sigma = 1e+200 (override): expected a number from 1e-06 to 1e+09"),
        ({"sigma": 1e-200}, "sensor.sigma = 1e-200 (override): expected a number from 1e-06 to 1e+09"),
        ({"beta_nt": 1e-300}, "tracker.beta_nt = 1e-300 (override): expected a number from 1e-36 to 1e+15"),
        (
            {"clutter_density": 1e-300},
            "expected false positives per m^2 from 1e-30 on, as the clutter density",
        ),
        ({"noise_cov": [[1.0, 1 - 1e-9], [1 - 1e-9, 1.0]]}, "expected a correlation within -0.999999 and 0.999999"),
        ({"noise_cov": [[1e-13, 0.0], [0.0, 1.0]]}, "expected variances from 1e-12 to 1e+18"),
        ({"metrics.order": 250}, "metrics.order = 250 (override): expected a number from 1 to 30"),
        ({"area": [0, 1e-7, 0, 1]}, "expected an area at least 1e-06 m wide and high"),
        ({"agents": [{"role": "benign"}] * 65}, "expected a list of at most 64 items"),
        ({"data": "a\0b"}, "targets.data = 'a\\x00b' (override): "),
        ({"data": "~nobody_of_this_name/a.csv"}, "there is no such file"),
    ],
)
def test_numbers_that_would_overflow_are_refused_with_their_range(error_of, overrides, expected: str) -> None:
    found = error_of("patrol", **overrides)
    assert expected in found
    assert len(found) < SHORT


def test_a_chain_of_bases_has_an_end(error_of, yaml_file) -> None:
    for i in range(400):
        yaml_file(f"base: {i + 1}.yaml\n", f"{i}.yaml")
    found = error_of("0.yaml")
    assert "more than 10 files, each the base of another" in found
    assert len(found) < SHORT


def test_paths_that_are_none_are_refused(error_of, yaml_file, tmp_path: Path) -> None:
    assert "'a\\x00b.yaml': embedded null byte; expected the path" in error_of(yaml_file('base: "a\\0b.yaml"'))
    assert "expected name, name(key=value, ...)" in error_of(yaml_file('base: "a\\0b"'))
    missing = error_of(yaml_file("base: ~nobody_of_this_name/a.yaml"))
    assert "base: ~nobody_of_this_name/a.yaml: there is no such file" in missing
    os.mkfifo(tmp_path / "pipe.yaml")
    assert "expected a YAML file, not a pipe or device" in error_of("pipe.yaml")
    os.mkfifo(tmp_path / "pipe.csv")
    for path in ("pipe.csv", "/dev/zero"):
        assert "expected a CSV file, not a pipe or device" in error_of("patrol", data=path)


def test_an_error_does_not_quote_a_file_that_is_no_recording(error_of, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("root:x:0:0:hunter2:/root:/bin/sh\nuser:hunter2\n")
    found = error_of("patrol", data=str(tmp_path / "secret"))
    assert "no column" in found
    assert "hunter2" not in found
    assert "/bin/sh" not in found


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("t,id,x,y,x\n0,a,1,2,3\n1,a,1,2,3\n", "line 1: column x is there more than once"),
        ("t,id,x,y\n0,a,1e300,2\n1,a,1,2\n", "line 2: x = 1e300: expected metres from -1e+09 to 1e+09"),
        ("t,id,x,y\n1e300,a,1,2\n1,a,1,2\n", "line 2: t = 1e300: expected seconds from -1e+15 to 1e+15"),
        ("t,id,x,y\n0,a,1,2\n" + "9" * 3_000_000, "field larger than field limit"),
    ],
)
def test_recordings_that_cannot_be_played_are_refused(tmp_path: Path, text: str, expected: str) -> None:
    (tmp_path / "traffic.csv").write_text(text)
    with pytest.raises(ValueError) as caught:
        read_recording(tmp_path / "traffic.csv", dt=1.0)
    assert expected in str(caught.value)
    assert len(str(caught.value)) < SHORT


@pytest.mark.parametrize(
    "text",
    ["a(b=" * 3000 + "1" + ")" * 3000, "a(b=" + "[" * 3000 + "]" * 3000 + ")", "a(b=" + "-" * 100_000 + "1)"],
)
def test_specs_nested_too_deep_are_refused(text: str) -> None:
    for read in (build_defense, load_scenario):
        with pytest.raises(ValueError) as caught:
            read(text)
        assert len(str(caught.value)) < SHORT


def test_a_mapping_that_contains_itself_is_refused() -> None:
    endless: dict[str, object] = {}
    endless["tracker"] = endless
    with pytest.raises(ScenarioError, match="nested too deep, or contains itself"):
        load_scenario(endless)
