"""`benchmark`: how it measures, and what it reports. Nothing here asserts a speed."""

import io
import json
import re
import sys
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

import trust_env
from trust_env.training import benchmark as run_benchmark
from trust_env.training.speed import peers, stages, startup, stone_soup, subjects
from trust_env.training.speed.benchmark import WANTED
from trust_env.training.speed.stopwatch import Spread, measure, ratio
from trust_env.training.speed.timings import Ratio, Timings


@pytest.fixture(scope="module")
def timings() -> Timings:
    return run_benchmark(quick=True, progress=False, seconds=0.001)


# --- the stopwatch --------------------------------------------------------------------------------------


def test_subjects_take_turns():
    order = []
    done = {"a": 0, "b": 0}

    def run(name):
        def subject(frames):
            order.append(name)
            done[name] += frames

        return subject

    turns = []
    rates = measure({"a": run("a"), "b": run("b")}, repetitions=4, seconds=1e-6, advance=turns.append)
    assert order[-8:] == ["a", "b"] * 4  # after warming up
    assert len(turns) == 2 * 5 and all(len(values) == 4 and min(values) > 0 for values in rates.values())


def test_spread_and_ratio_by_hand():
    assert Spread.of([3.0, 1.0, 2.0, 10.0]) == Spread(2.5, 1.0, 10.0)
    rates = {"ours": [10.0, 30.0, 20.0], "peer": [1.0, 2.0, 4.0]}
    assert ratio(rates, "ours", "peer") == Spread(10.0, 5.0, 15.0)


def test_a_ratio_stands_beside_what_is_wanted_and_is_not_judged(cli, monkeypatch, timings):
    """How busy the machine is does not fail the command."""
    slow = replace(timings, ratios=[Ratio("ours", "peer", Spread(0.125, 0.0, 0.25), 15, 25)])
    monkeypatch.setattr(sys.modules["trust_env.training.speed.benchmark"], "benchmark", lambda quick: slow)
    code, out, err = cli("benchmark")
    assert (code, err) == (0, "") and re.search(r"ours +│ peer +│ +0.125 +│ .* 15 │ +25 ", out)
    found = json.loads(cli("benchmark", "--json")[1])
    times = {"median": 0.125, "low": 0.0, "high": 0.25}
    assert found["ratios"] == [{"ours": "ours", "peer": "peer", "times": times, "wanted": 15, "aim": 25}]


# --- subjects and peers ---------------------------------------------------------------------------------


def test_recorded_detections_give_the_environments_tracks():
    recorded = subjects.record("trio")
    env = trust_env.vector_env("trio", "trust", autoreset=False)
    env.reset(seed=0)
    centre = trust_env.FusionCentre("trio", "trust")
    for frame in range(30):
        env.step(np.zeros(env.arrays.action.shape))
        fused = centre.update(recorded.detections(frame), poses=recorded.poses)
    there = env.arrays.track_status[0] > 0
    order = np.argsort(env.arrays.track_id[0, there])
    assert fused.track_id.tolist() == env.arrays.track_id[0, there][order].tolist()
    assert np.array_equal(fused.tracks, env.arrays.track_mean[0, there][order])
    assert np.array_equal(fused.agent_trust, env.arrays.agent_trust[0])


def test_subjects_run_past_the_end_of_an_episode():
    subjects.parallel_subject("case1")(45)
    subjects.centre_subject(subjects.record("case1"))(45)
    venv = trust_env.vector_env("case1", num_worlds=4)
    subjects.vector_subject(venv)(4 * 45)
    assert venv.arrays.episode.reshape(-1).tolist() == [2] * 4 and venv.arrays.frame.reshape(-1)[0] == 5


@pytest.mark.extra("bench")
def test_peers_run_past_the_end_of_an_episode():
    recorded = subjects.record("case1")
    peers.mpe2_subject()(60)
    stone_soup.stonesoup_subject(recorded)(45)
    peers.oracle_subject(recorded)(45)


@pytest.mark.extra("bench")
def test_stone_soup_follows_the_targets():
    """The peer does the work that it is timed for."""
    recorded = subjects.record("case1")
    tracker = stone_soup._stonesoup_tracker(recorded)
    for _ in zip(range(len(recorded.reports) * 3), tracker, strict=False):
        pass
    places = np.array([[float(t.state_vector[0]), float(t.state_vector[2])] for t in tracker.tracks])
    for target in recorded.scenario.targets.positions:
        assert np.linalg.norm(places - target, axis=1).min() < 0.02


def test_stages_run_one_by_one_are_frames():
    """What is timed is what a step does."""
    timed, stepped = (trust_env.vector_env("trio", num_worlds=3, threads=1, autoreset=False) for _ in range(2))
    stages.stage_times(timed)
    stepped.reset(seed=0)
    for _ in range(stages.WARM_UP + stages.FRAMES):
        stepped.step(subjects.attack_actions(stepped.scenario, stepped.arrays.action.shape))
    for name, array in stepped.arrays.items():
        assert np.array_equal(timed.arrays[name], array, equal_nan=array.dtype.kind == "f"), name


# --- start-up -------------------------------------------------------------------------------------------


def test_import_loads_nothing_heavy():
    found = startup.import_time(1)
    assert found["brings_in"] == [] and found["seconds"]["median"] > 0


def test_first_frame_starts_from_an_empty_cache_and_then_from_a_full_one(monkeypatch):
    code = (
        "import json, os, pathlib\n"
        "folder = pathlib.Path(os.environ['NUMBA_CACHE_DIR'])\n"
        "print(json.dumps({'seconds': float(len(list(folder.iterdir())))}))\n"
        "(folder / 'compiled').write_text('')\n"
    )
    monkeypatch.setattr(startup, "_FIRST_FRAME", code)
    assert startup.first_frame() == {"compiling_seconds": 0.0, "from_cache_seconds": 1.0}


def test_a_failing_interpreter_raises_its_error_message():
    with pytest.raises(RuntimeError, match="no such thing"):
        startup._run_python("raise SystemExit('no such thing')")


# --- the report -----------------------------------------------------------------------------------------


def test_report_is_plain_and_complete(timings):
    found = json.loads(json.dumps(timings.to_dict(), allow_nan=False))
    rates, ratios = found["frames_per_second"], found["ratios"]
    assert {each["ours"] for each in ratios} | {each["peer"] for each in ratios} <= set(rates)
    named = {name for pair in WANTED for name in pair}
    assert named <= set(rates) | set(found["skipped"])
    assert all(0 < rate["low"] <= rate["median"] <= rate["high"] for rate in rates.values())
    assert [load["scenario"] for load in found["loads"]] == ["patrol", "crowd"]
    assert all(load["pairs"] > 0 and load["ns_per_pair"] > 0 for load in found["loads"])
    assert {"track_locally", "score_picture"} < set(found["stages"]) and min(found["stages"].values()) > 0
    assert found["startup"]["import"]["brings_in"] == [] and "compiling" in found["skipped"]
    assert found["machine"]["processors"] >= 1


def test_report_prints_every_table(timings):
    console = Console(width=150, record=True, file=io.StringIO())
    timings.print(console)
    text = console.export_text()
    for part in (
        "Frames per second",
        "How many times as fast",
        "ns per pair",
        "import trust_env",
        "crowd",
        "gather_evidence",
    ):
        assert part in text


def test_missing_peers_are_skipped_by_name(monkeypatch, tmp_path):
    for module in ("mpe2", "stonesoup", "stable_baselines3"):
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setattr(peers, "ORACLE", tmp_path / "oracle.py")
    found = run_benchmark(quick=True, progress=False, seconds=0.001)
    assert found.ratios == []
    reasons = " ".join(found.skipped.values())
    for missing in ("mpe2", "stonesoup", "stable_baselines3", "tests/oracle.py"):
        assert missing in reasons
