"""Evaluations: what they measure, what they write, and what survives an interruption."""

import errno
import json
import os
import subprocess
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest
from folder_runs import EVALUATE, kill, out_of_space, played_in_peace
from paths import ROOT
from scipy.stats import trim_mean

import trust_env
import trust_env.training.evaluation.run_folder as run_folder
from trust_env import files, training
from trust_env.agents import Player
from trust_env.metrics import METRICS, RELIABILITY, EpisodeMetrics
from trust_env.training.evaluation.results import Results

SMALL = {"scenario": "trio(horizon=25)", "episodes": 6, "seed": 3, "progress": False}
IDS = ["attack", "defense", "scenario", "seed", "world", "episode", "version"]


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> tuple[Results, str]:
    """Two attacks against two defenses, and the folder with their files."""
    out = tmp_path_factory.mktemp("evaluation") / "out"
    attacks, defenses = "honest,optimal_false_positive(n=1)", "score,trust(preset=cdc2024)"
    return training.evaluate(attacks=attacks, defenses=defenses, out=out, **SMALL), str(out)


def test_results_json_holds_every_cell_with_intervals(run):
    results, out = run
    with open(f"{out}/results.json", encoding="utf-8") as file:
        written = json.load(file)
    assert written == results.to_dict()
    assert list(written) == ["scenario", "knowledge", "seed", "episodes", "version", "cells", "pooled"]
    assert (written["scenario"], written["seed"], written["episodes"]) == ("trio", 3, 6)
    assert written["version"] == trust_env.parallel_env("trio").metadata["name"] == "trust_env_v0"
    cells = [(cell["attack"], cell["defense"]) for cell in written["cells"]]
    attack = "optimal_false_positive(n=1)"
    assert cells == [(a, d) for a in ("honest", attack) for d in ("score", "trust(preset=cdc2024)")]
    for cell in written["cells"]:
        assert set(cell) == {"attack", "defense", "metrics", "pooled", "strata"}
        for name, values in cell["metrics"].items():
            assert name in METRICS
            assert list(values)[:7] == ["mean", "worst_decile", "iqm", "low", "high", "mean_low", "mean_high"]
            assert (list(values)[7:] == ["never"]) == (METRICS[name].never_where is not None)
            if values["iqm"] is not None:
                assert values["low"] <= values["iqm"] <= values["high"]
                assert values["mean_low"] <= values["mean"] <= values["mean_high"]
    never = written["cells"][0]["metrics"]["frames_to_first_false_track"]
    assert never["never"] == 1.0 and set(list(never.values())[:7]) == {None}
    assert "adversary_auroc" not in written["cells"][0]["metrics"]  # `score` has no opinion on agents
    assert "adversary_auroc" not in written["cells"][1]["metrics"]  # nobody edits
    assert "adversary_auroc" in written["cells"][3]["metrics"]


def test_results_parquet_has_a_row_per_episode(run):
    results, out = run
    table = pq.read_table(f"{out}/results.parquet")
    assert table.column_names == [*IDS, *METRICS, *(f"{kind}_bins" for kind in RELIABILITY)]
    rows = table.to_pylist()
    assert len(rows) == 4 * 6
    assert [row["world"] for row in rows[:6]] == [0, 1, 2, 3, 4, 5]
    assert {(row["scenario"], row["seed"], row["episode"], row["version"]) for row in rows} == {
        ("trio", 3, 0, "trust_env_v0")
    }
    assert all(row["track_auroc"] is None and row["false_accusation_rate"] is None for row in rows[:6])
    assert all(row["damage_per_frame"] is not None for row in rows)
    values = [row["damage_per_frame"] for row in rows[6:12]]
    found = results["honest", "trust(preset=cdc2024)"].summary["damage_per_frame"]
    assert found.iqm == trim_mean(values, 0.25)


def test_every_row_can_be_replayed(run):
    """Seed, world and episode of a row, in a PettingZoo environment with its policy, give its metrics."""
    _, out = run
    for row in pq.read_table(f"{out}/results.parquet").to_pylist()[4::6]:
        env = trust_env.parallel_env("trio(horizon=25)", row["defense"])
        player, metrics = Player(env, {"adversary": row["attack"]}), EpisodeMetrics(env)
        observations, _ = env.reset(seed=row["seed"], options={k: row[k] for k in ("world", "episode")})
        while env.agents:
            observations, *_ = env.step(player.actions(observations))
            metrics.update()
        replayed = {name: values[0] for name, values in metrics.result().items()}
        written = {name: np.nan if row[name] is None else row[name] for name in METRICS}
        assert replayed == pytest.approx(written, abs=0, nan_ok=True)


def test_metrics_respond_to_the_attack_and_to_the_defense(run):
    """Phantoms show under attack only, and rejections by a defense that rejects only."""
    results, _ = run
    attack, trust = "optimal_false_positive(n=1)", "trust(preset=cdc2024)"
    for defense in ("score", trust):
        assert results["honest", defense].metrics["injected_tracks_per_frame"].max() == 0.0
        assert np.isnan(results["honest", defense].metrics["frames_to_first_false_track"]).all()
    assert results[attack, "score"].metrics["injected_tracks_per_frame"].min() > 0.5
    assert results[attack, "score"].metrics["false_track_rejection_rate"].max() == 0.0
    difference = results.difference((attack, "score"), ("honest", "score"), "injected_tracks_per_frame")
    assert difference is not None
    assert difference.low > 0.5
    mean = results.mean_difference((attack, "score"), ("honest", "score"), "injected_tracks_per_frame")
    assert mean is not None and mean.value == results[attack, "score"].metrics["injected_tracks_per_frame"].mean()
    back = results.difference(results["honest", "score"], results[attack, "score"], "injected_tracks_per_frame")
    assert back is not None
    assert back.iqm == -difference.iqm
    assert results.difference((attack, "score"), (attack, trust), "adversary_auroc") is None
    with pytest.raises(ValueError, match=r"unknown metric 'damage'; .*damage_per_frame"):
        results.difference((attack, "score"), ("honest", "score"), "damage")
    with pytest.raises(ValueError, match="unknown cell 'nobody x score'"):
        results["nobody", "score"]


def _same(a: Results, b: Results) -> bool:
    pairs = list(zip(a.cells, b.cells, strict=True))
    return all(
        x.key == y.key and all(np.array_equal(x.metrics[n], y.metrics[n], equal_nan=True) for n in METRICS)
        for x, y in pairs
    )


def test_a_cell_does_not_depend_on_batch_size_or_on_other_cells(run, monkeypatch):
    results, _ = run
    monkeypatch.setattr(sys.modules["trust_env.training.evaluation.evaluate"], "MAX_WORLDS", 4)  # 3 + 3 worlds
    alone = training.evaluate(attacks="optimal_false_positive(n=1)", defenses=["score"], **SMALL)
    expected = results["optimal_false_positive(n=1)", "score"].metrics
    assert all(np.array_equal(alone.cells[0].metrics[n], expected[n], equal_nan=True) for n in METRICS)


def test_all_cells_are_played_at_the_knowledge_level_that_one_needs():
    results = training.evaluate(attacks="honest,fov_aware", defenses="trust", **SMALL)
    (note,) = results.notes
    assert note.startswith("knowledge: own in the scenario, poses here for all cells, needed by fov_aware")
    at_own = training.evaluate(attacks="honest", defenses="trust", **SMALL)
    assert at_own.notes == ()
    for name in METRICS:
        np.testing.assert_array_equal(at_own.cells[0].metrics[name], results["honest", "trust"].metrics[name])


def test_results_name_the_preset_and_are_found_without_it():
    results = training.evaluate(attacks="honest", defenses="trust,trust(preset=mate),score", **SMALL)
    assert [cell.defense for cell in results.cells] == ["trust(preset=paper)", "trust(preset=mate)", "score"]
    assert results["honest", "trust"] is results["honest", "trust(preset=paper)"] is results.cells[0]
    assert set(results.to_arrow()["defense"].to_pylist()) == {"trust(preset=paper)", "trust(preset=mate)", "score"}
    with pytest.raises(ValueError, match="majority"):
        results["honest", "majority"]


def test_a_defense_that_is_named_with_and_without_its_preset_is_given_twice():
    with pytest.raises(ValueError, match="given twice"):
        training.evaluate(attacks="honest", defenses="trust,trust(preset=paper)", **SMALL)


def test_a_note_says_that_a_scenario_has_no_adversaries():
    settings = SMALL | {"scenario": "trio(horizon=12, n_adversaries=0)"}
    results = training.evaluate(attacks="false_positive", defenses="trust", **settings)
    assert results.notes == ("trio has no adversaries, so that all attacks come to the same",)
    assert "adversary_auroc" not in results.cells[0].summary
    assert "detection_delay" not in results.cells[0].summary
    assert results.cells[0].summary["frames_to_first_false_track"].never == 1.0


_DEFENSE = """
import numpy as np
from trust_env import Verdict

class Nothing:
    "Publishes nothing; accuses everybody."
    def __init__(self, trust=0.1):
        self.trust = trust
    def reset(self, shape, worlds):
        self.shape = shape
    def update(self, evidence):
        W, K, J, _ = self.shape
        return Verdict(agent_trust=np.full((W, K), self.trust), publish=np.zeros((W, J), bool))
"""


def test_defenses_of_the_user_are_taken_by_file_and_as_objects(tmp_path):
    (tmp_path / "mine.py").write_text(_DEFENSE)
    spec = f"{tmp_path}/mine.py:Nothing(trust=0.2)"
    results = training.evaluate(attacks="honest", defenses=[spec, "score"], out=tmp_path / "out", **SMALL)
    blind = results.cells[0]
    assert blind.defense == spec
    assert blind.metrics["false_tracks_per_frame"].max() == 0.0
    assert set(blind.metrics["missing_fraction"]) == {1.0}
    assert set(blind.metrics["true_track_rejection_rate"]) == {1.0}
    assert set(blind.metrics["false_accusation_rate"]) == {1.0}
    assert np.isnan(blind.metrics["detection_delay"]).all()
    assert blind.metrics["agent_trust_brier"] == pytest.approx(0.8**2)

    from trust_env.spec import load_object, parse

    made = load_object(parse(spec))(0.2)
    (same,) = training.evaluate(attacks="honest", defenses=made, **SMALL).cells
    assert same.defense == "Nothing"
    np.testing.assert_array_equal(same.metrics["agent_trust_brier"], blind.metrics["agent_trust_brier"])

    (tmp_path / "mine.py").write_text(_DEFENSE + "\n# changed\n")
    with pytest.raises(ValueError, match=r"another configuration.*files.*mine.py"):
        training.evaluate(attacks="honest", defenses=[spec, "score"], out=tmp_path / "out", resume=True, **SMALL)


# --- folders -----------------------------------------------------------------------------------------


def _evaluate(out, **changes):
    settings = SMALL | {"attacks": "honest,suppress", "defenses": "score", "out": out} | changes
    return training.evaluate(**settings)


def test_nothing_is_overwritten(tmp_path):
    first = _evaluate(tmp_path / "out")
    stamp = (tmp_path / "out" / "results.parquet").read_bytes()
    with pytest.raises(ValueError, match=r"out: the folder is not empty .* nothing is overwritten; .*--resume"):
        _evaluate(tmp_path / "out")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.tex").write_text("mine")
    for resume in (False, True):
        with pytest.raises(ValueError, match=r"thesis\.tex"):
            _evaluate(tmp_path / "other", resume=resume)
    with pytest.raises(ValueError, match="expected a folder, this is a file"):
        _evaluate(tmp_path / "other" / "thesis.tex")
    assert (tmp_path / "out" / "results.parquet").read_bytes() == stamp
    assert [p.name for p in (tmp_path / "other").iterdir()] == ["thesis.tex"]
    assert _same(_evaluate(tmp_path / "out", resume=True), first)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"seed": 4}, "seed is 3 there, 4 here"),
        ({"episodes": 7}, "episodes is 6 there, 7 here"),
        ({"attacks": "honest"}, r'attacks is \["honest", "suppress"\] there, \["honest"\] here'),
        ({"overrides": {"tracker.gate": 0.9}}, r"scenario.tracker.gate is [0-9.]+ there, 0.9 here"),
        ({"actuation": "monitor"}, 'scenario.actuation is "filter" there, "monitor" here'),
        ({"max_cycles": 20}, "horizon is 25 there, 20 here"),
    ],
)
def test_only_the_same_configuration_is_resumed(tmp_path_factory, changes, text):
    out = tmp_path_factory.getbasetemp() / "configuration"
    if not out.exists():
        _evaluate(out)
    with pytest.raises(ValueError, match=f"belongs to another configuration.*{text}"):
        _evaluate(out, resume=True, **changes)


def test_results_of_something_else_are_not_resumed(tmp_path):
    (tmp_path / "results.parquet").write_bytes(b"PAR1 but not really")
    with pytest.raises(ValueError, match=r"results\.parquet: not the results of an evaluation"):
        _evaluate(tmp_path, resume=True)


def test_a_full_disk_keeps_the_finished_cells(tmp_path, monkeypatch):
    full = _evaluate(tmp_path / "whole")
    saved, replace = [], os.replace

    def fails_at_the_second_cell(source, target):
        saved.append(target)
        if len(saved) > 6:  # three files before the first cell, three after it
            raise OSError(errno.ENOSPC, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(os, "replace", fails_at_the_second_cell)
    with pytest.raises(OSError, match=r"No space left on device.*courses\.parquet"):
        _evaluate(tmp_path / "out")
    monkeypatch.undo()
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["courses.parquet", "results.json", "results.parquet"]
    assert set(pq.read_table(tmp_path / "out" / "results.parquet")["attack"].to_pylist()) == {"honest"}
    assert _same(_evaluate(tmp_path / "out", resume=True), full)


def test_a_folder_that_cannot_be_written_raises_before_anything_is_computed(tmp_path, monkeypatch):
    def play(*_):
        raise AssertionError("computed")

    monkeypatch.setattr(sys.modules["trust_env.training.evaluation.evaluate"]._Evaluation, "_play_cell", play)
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        _evaluate(tmp_path / "file" / "out")
    usage = run_folder.shutil.disk_usage(tmp_path)
    monkeypatch.setattr(run_folder.shutil, "disk_usage", lambda _: usage._replace(free=1000))
    with pytest.raises(OSError, match="MiB needed"):
        _evaluate(tmp_path / "out")


def test_resume_plays_only_what_is_missing(tmp_path, monkeypatch):
    runner = sys.modules["trust_env.training.evaluation.evaluate"]._Evaluation
    play, played = runner._play_cell, []

    def stops_at_the_second(self, attack, defense, advance):
        played.append(attack.name)
        if len(played) == 2:
            raise KeyboardInterrupt
        return play(self, attack, defense, advance)

    monkeypatch.setattr(runner, "_play_cell", stops_at_the_second)
    with pytest.raises(KeyboardInterrupt):
        _evaluate(tmp_path / "out")
    assert played == ["honest", "suppress"]
    _evaluate(tmp_path / "out", resume=True)
    assert played == ["honest", "suppress", "suppress"]


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    """A folder, the cells in it, and the seconds that the command took."""
    folder = tmp_path_factory.mktemp("evaluation") / "whole"
    return folder, *played_in_peace(EVALUATE, folder)


def test_a_run_killed_before_and_between_cells_gives_the_results_of_an_uninterrupted_one(uninterrupted, tmp_path):
    """kill -9 while it starts, and after cells; what is finished stays, and all rows are the same in the end."""
    (folder, whole, seconds), out = uninterrupted, tmp_path / "out"
    survived = [kill(EVALUATE, out, count, delay) for count, delay in ((0, seconds / 4), (1, 0.0), (4, 0.05))]
    assert survived == sorted(survived) and 1 <= survived[1] < len(whole)
    assert played_in_peace(EVALUATE, out)[0] == whole and len(whole) == 12
    assert sorted(p.name for p in out.iterdir()) == ["courses.parquet", "results.json", "results.parquet"]
    assert (out / "results.json").read_bytes() == (folder / "results.json").read_bytes()


def test_a_second_process_in_the_same_folder_is_refused_whether_it_begins_or_resumes(tmp_path):
    first = _evaluate(tmp_path)
    stamp = (tmp_path / "results.parquet").read_bytes()
    with files.locked(tmp_path):
        for resume in (False, True):
            with pytest.raises(ValueError, match="another process is at work in this folder"):
                _evaluate(tmp_path, resume=resume)
        assert (tmp_path / "results.parquet").read_bytes() == stamp
    assert _same(_evaluate(tmp_path, resume=True), first)


def test_a_full_disk_keeps_the_cells_and_the_command_names_the_file(uninterrupted, tmp_path):
    """A limit to the size of files stands for the disk: a file outgrows it at once, or after some cells."""
    _, whole, _ = uninterrupted
    told = out_of_space(EVALUATE, tmp_path / "none", 100)
    assert told == f"trust-env: error: {tmp_path}/none/courses.parquet: File too large\n"
    out = tmp_path / "out"
    told = out_of_space(EVALUATE, out, 22_000)
    assert f"the finished cells are in {out}; --resume continues" in told
    assert told.endswith(f"error: {out}/results.parquet: File too large\n")
    assert 1 <= len(EVALUATE.finished(out)) < len(whole)
    assert played_in_peace(EVALUATE, out)[0] == whole


def test_of_two_processes_started_at_once_one_plays_and_one_is_refused(uninterrupted, tmp_path):
    _, whole, _ = uninterrupted
    begin = {"cwd": ROOT, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    both = [subprocess.Popen(EVALUATE.command(tmp_path / "out"), **begin) for _ in range(2)]
    ended = sorted((each.communicate()[1], each.returncode) for each in both)
    assert [code for _, code in ended] in ([0, 2], [0, 0])  # [0, 0]: one had ended before the other began
    assert all("another process is at work in this folder" in text for text, code in ended if code)
    assert EVALUATE.finished(tmp_path / "out") == whole


# --- what is refused ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"attacks": "false_positiv"}, "did you mean 'false_positive'"),
        ({"attacks": "suppress(fraction=2)"}, "fraction = 2"),
        ({"attacks": "honest, honest"}, "attack honest: given twice"),
        ({"attacks": []}, "no attack is given"),
        ({"defenses": "truts"}, "did you mean 'trust'"),
        ({"defenses": "trust(trusted=[7])"}, "agents are 0 to 2"),
        ({"scenario": "petrol"}, "did you mean 'patrol'"),
        ({"scenario": "skies"}, "targets.data"),
        ({"overrides": {"tracker.gat": 0.9}}, "did you mean 'tracker.gate'"),
        ({"episodes": 0}, "episodes must be a whole number of at least 1; got 0"),
        ({"seed": -1}, "seed must be an integer from 0"),
        ({"max_cycles": 0}, "max_cycles must be a whole number of at least 1"),
    ],
)
def test_what_cannot_be_played_raises_before_the_folder_is_made(tmp_path, changes, text):
    with pytest.raises(ValueError, match=text):
        _evaluate(tmp_path / "out", **changes)
    assert not (tmp_path / "out").exists()
