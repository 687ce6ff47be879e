"""Fields that a recording, or the list of positions, decides."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from paths import TRAFFIC

from trust_env.scenario import load_scenario, scenario_fields


def test_without_its_recording_skies_says_how_to_give_one(error_of) -> None:
    text = error_of("skies")
    assert text.startswith("skies: targets.data = null")
    assert "a recording decides horizon, area, targets.slots" in text
    assert 'load_scenario("skies", data="traffic.csv")' in text
    assert "skies(data='traffic.csv')" in text
    assert scenario_fields("skies")["description"].startswith("Recorded air traffic")


@pytest.mark.skipif(not TRAFFIC.exists(), reason="the recording of UK traffic is not here")
def test_the_recording_decides_what_is_null(error_of) -> None:
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
    assert "at most 121, the frames of the recording" in error_of(skies, horizon=122)
    assert load_scenario(skies, horizon=50).horizon == 50


def test_paths_are_relative_to_the_file_that_names_them(error_of, yaml_file, tmp_path: Path) -> None:
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
    text = error_of(derived, n_benign=50, horizon=2)
    assert "expected a recording of at least 52 different positions" in text


def test_a_broken_recording_is_named_with_its_line(error_of, yaml_file, tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text("t,id,x,y\n0,a,0,zero\n")
    text = error_of(yaml_file("base: skies\ntargets:\n  data: bad.csv\n"))
    assert text.startswith(f"my.yaml, line 3: targets.data = '{tmp_path.resolve()}/bad.csv': ")
    assert "bad.csv, line 2: y = 'zero': expected a finite number" in text
    assert "there is no such file" in error_of("skies", data="nowhere.csv")


def test_fixed_positions_decide_the_slots() -> None:
    scenario = load_scenario("patrol", positions=[[0, 0], [1, 1]], velocities=[[1, 0], [0, 1]])
    assert scenario.targets.slots == 2


def test_positions_and_a_recording_exclude_each_other(error_of, yaml_file, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,id,x,y\n0,a,0,0\n1,a,1,0\n")
    text = error_of(yaml_file("horizon: 2\ntargets: {data: a.csv, positions: [[0, 0]]}\n"))
    assert "targets.data" in text
    assert "expected null, as positions are given" in text
