"""Reports: what stands in the page is what the runs' own files say, whatever they are runs of."""

import json
import shlex
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest
from paths import ROOT

from trust_env import training
from trust_env.training.evaluation.evaluate import evaluate
from trust_env.training.reports import report as report_module
from trust_env.training.reports.evaluation import COLUMNS, Evaluation, tidied
from trust_env.training.reports.replays import replays

TRIO = {"base": "trio", "horizon": 15}
DEFENSES = "score,trust,oracle"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run of two attacks and three defenses, a curve, and two training runs as `train` writes them."""
    root = tmp_path_factory.mktemp("report")
    evaluate(TRIO, "honest,false_positive", DEFENSES, 5, 3, out=root / "run", progress=False)
    training.curve("slots", [1, 4], TRIO, episodes=3, out=root / "curve", progress=False)
    for seed, damages in ((0, (1.0, 2.0)), (1, (1.5, 3.0))):
        (root / f"train_{seed}").mkdir()
        config = f"scenario: trio\ndefense: trust\nrole: adversary\nseed: {seed}\n"
        (root / f"train_{seed}" / "config.yaml").write_text(config)
        lines = ["steps,damage_per_frame,false_tracks_per_frame,missing_targets_per_frame"]
        lines += [f"{100 * i},{d},{d - 0.5},0.5" for i, d in enumerate(damages)]
        (root / f"train_{seed}" / "evaluations.csv").write_text("\n".join(lines) + "\n")
    return root


@pytest.fixture(scope="module")
def found(folder):
    runs = [folder / name for name in ("run", "curve", "train_0", "train_1")]
    return training.report(runs, folder / "report.html", cells=1, progress=False)


def test_numbers_are_those_of_results_json(folder, found):
    written = json.loads((folder / "run" / "results.json").read_text())
    section = found["sections"][0]
    assert [cell["attack"] for cell in section["cells"]] == ["honest"] * 3 + ["false_positive"] * 3
    for cell, expected in zip(section["cells"], written["cells"], strict=True):
        for value, (metric, statistic) in zip(cell["values"], COLUMNS.values(), strict=True):
            assert value["value"] == (expected["metrics"].get(metric) or {}).get(statistic)
        assert cell["pooled"] == expected["pooled"]
        summary = expected["metrics"]["damage_per_frame"]
        assert cell["damage"] == [summary["mean"], summary["mean_low"], summary["mean_high"]]


def test_defenses_at_a_glance_are_ordered_by_their_worst_attack(found):
    cells = {(c["attack"], c["defense"]): c["damage"][0] for c in found["sections"][0]["cells"]}
    glance = found["sections"][0]["glance"]
    for row in glance:
        means = {attack: value for (attack, defense), value in cells.items() if defense == row["defense"]}
        assert row["worst"] == pytest.approx(max(means.values())) == pytest.approx(means[row["attack"]])
        assert row["mean"] == pytest.approx(np.mean(list(means.values())))
    assert [row["worst"] for row in glance] == sorted(row["worst"] for row in glance)


def test_differences_are_from_the_defense_that_is_chosen(folder, found):
    assert found["sections"][0]["compared"]["against"] == "score"
    run = Evaluation(folder / "run")
    rows = run.section("oracle")["compared"]["rows"]
    damage = {cell.key: cell.metrics["damage_per_frame"] for cell in run.results.cells}
    assert len(rows) == 4
    for row in rows:
        pairs = damage[row["attack"], row["defense"]] - damage[row["attack"], "oracle"]
        assert row["difference"]["value"] == pytest.approx(pairs.mean())
    with pytest.raises(ValueError, match="did you mean 'score'"):
        run.section("scor")


def test_the_worst_the_median_and_the_best_episode_of_the_highest_cell_are_played(folder, found):
    rows = pq.read_table(folder / "run" / "results.parquet").to_pylist()
    by_cell = {}
    for row in rows:
        by_cell.setdefault((row["attack"], row["defense"]), []).append(row["damage_per_frame"])
    judged = {key: values for key, values in by_cell.items() if key[1] != "oracle"}
    attack, defense = max(judged, key=lambda key: np.mean(judged[key]))
    values = sorted(judged[attack, defense])
    played = [replay["recordings"][0] for replay in found["replays"]]
    assert {(each["attack"], each["defense"]) for each in played} == {(attack, defense)}
    assert [each["metrics"]["damage_per_frame"] for each in played] == [values[4], values[2], values[0]]
    assert [replay["label"].split(", ")[1].split(":")[0] for replay in found["replays"]] == ["worst", "median", "best"]


def test_beside_an_episode_stands_the_same_one_under_the_defense_compared_with(folder, found, tmp_path):
    rows = pq.read_table(folder / "run" / "results.parquet").to_pylist()
    damage = {(row["attack"], row["defense"], row["world"]): row["damage_per_frame"] for row in rows}
    against_trust = training.report(folder / "run", tmp_path / "a.html", "trust", 1, progress=False)
    for against, report in (("score", found), ("trust(preset=paper)", against_trust)):
        for own, other in (replay["recordings"] for replay in report["replays"]):
            assert own["world"] == other["world"] and own["attack"] == other["attack"]
            expected = against if own["defense"] != against else {"score": "trust(preset=paper)"}.get(against, "score")
            assert other["defense"] == expected
            assert other["metrics"]["damage_per_frame"] == damage[other["attack"], expected, other["world"]]


def test_a_curve_has_a_line_for_every_defense_and_training_runs_stand_together(folder, found):
    _, curve, learning = found["sections"]
    written = json.loads((folder / "curve" / "curve.json").read_text())
    assert (curve["kind"], curve["values"]) == ("curve", [1, 4])
    assert curve["command"] == tidied(shlex.join(sys.argv))
    for number, line in enumerate(curve["lines"]):
        means = [p["results"]["cells"][number]["metrics"]["damage_per_frame"]["mean"] for p in written["points"]]
        assert line["mean"] == means
    assert learning["kind"] == "learning"
    assert [(run["seed"], run["damage_per_frame"]) for run in learning["runs"]] == [(0, [1.0, 2.0]), (1, [1.5, 3.0])]


def test_an_exploitation_shows_its_attackers_and_its_evaluation(folder, tmp_path):
    import shutil

    outcome = {"mean": {"value": 2.0, "low": 1.0, "high": 3.0}, "worst_decile": {"value": 4.0, "low": 3.0, "high": 5.0}}
    margin = {"value": 0.5, "low": 0.1, "high": 0.9}
    attacker = {"kind": "scripted", "name": "a", "damage": outcome, "validation_damage": 2.5}
    attacker["margin_over_scripted"] = margin
    kept = {"scenario": "trio", "defense": "score", "episodes": 5, "seed": 3, "version": "v", "claim": "c", "worst": {}}
    (tmp_path / "exploit.json").write_text(json.dumps({**kept, "attackers": [attacker]}))
    shutil.copytree(folder / "run", tmp_path / "evaluation")
    found = training.report(tmp_path, tmp_path / "report.html", cells=0, progress=False)
    assert [section["kind"] for section in found["sections"]] == ["exploitation", "evaluation"]
    assert found["sections"][0]["attackers"] == [attacker]
    (tmp_path / "exploit.json").write_text(json.dumps(kept))
    with pytest.raises(ValueError, match=r"exploit\.json: not as this version writes it: KeyError 'attackers'"):
        training.report(tmp_path, tmp_path / "report.html", cells=0)


def test_the_page_needs_no_network_and_stays_below_its_limit(folder, found):
    page = (folder / "report.html").read_text()
    assert len(page.encode()) < 3_000_000
    assert "<script src" not in page and "stylesheet" not in page


def test_replays_for_which_there_is_no_room_are_named(folder, tmp_path, monkeypatch):
    without = training.report(folder / "run", tmp_path / "a.html", cells=0, progress=False)
    assert without["replays"] == [] and without["left_out"] == []
    monkeypatch.setattr(report_module, "MOST_BYTES", (tmp_path / "a.html").stat().st_size + 50_000)
    found = training.report(folder / "run", tmp_path / "b.html", cells=2, progress=False)
    shown = [len(replay["recordings"]) for replay in found["replays"]]
    assert sum(shown) + len(found["left_out"]) == 12 and max(shown, default=1) == 1
    assert found["left_out"] and all("no room in" in text for text in found["left_out"])
    assert (tmp_path / "b.html").stat().st_size <= report_module.MOST_BYTES + 2_000  # the list of what is left out


def test_what_cannot_be_replayed_is_said_and_the_rest_shown(folder, tmp_path):
    class Mine:
        def reset(self, shape, worlds): ...

        def update(self, evidence):
            from trust_env.defenses import Verdict

            return Verdict()

    evaluate(TRIO, "false_positive", [Mine()], 3, out=tmp_path / "run", progress=False)
    found = list(replays(Evaluation(tmp_path / "run"), 1, None, {}))
    assert all("expected it as an object" in played.fault for played in found) and len(found) == 3
    shown = training.report(tmp_path / "run", tmp_path / "a.html", progress=False)
    assert len(shown["left_out"]) == 1 and shown["left_out"][0].startswith("false_positive x Mine: defense Mine")
    shown = training.report(tmp_path / "run", tmp_path / "b.html", defenses=[Mine()], progress=False)
    assert [len(replay["recordings"]) for replay in shown["replays"]] == [1, 1, 1] and shown["left_out"] == []


def test_a_run_that_was_broken_off_shows_the_cells_that_it_has_and_how_many_are_missing(folder, tmp_path):
    import shutil

    shutil.copytree(folder / "run", tmp_path / "run")
    file = tmp_path / "run" / "results.json"
    written = json.loads(file.read_text())
    del written["cells"][1]  # written to results.parquet only
    file.write_text(json.dumps(written))
    found = training.report(tmp_path / "run", tmp_path / "report.html", cells=12, progress=False)
    section = found["sections"][0]
    assert section["missing"] == 1 and len(section["cells"]) == 5 and len(found["replays"]) == 9
    assert ("honest", "trust(preset=paper)") not in {(cell["attack"], cell["defense"]) for cell in section["cells"]}
    assert "Not finished: 1 of 6 cells." in (tmp_path / "report.html").read_text()
    file.write_text(json.dumps({**written, "cells": []}))
    with pytest.raises(ValueError, match="no cell is finished"):
        training.report(tmp_path / "run", tmp_path / "report.html")


def test_a_folder_without_courses_gives_a_page_without_them(folder, tmp_path):
    import shutil

    shutil.copytree(folder / "run", tmp_path / "run")
    (tmp_path / "run" / "courses.parquet").unlink()
    found = training.report(tmp_path / "run", tmp_path / "report.html", cells=0, progress=False)
    assert not found["sections"][0]["has_courses"]
    assert "ROC of accusation" not in (tmp_path / "report.html").read_text().split("<script")[0]


def test_the_program_reports_and_refuses_what_is_no_run(cli, folder, tmp_path):
    code, out, err = cli("report", folder / "run", "--out", tmp_path / "r.html", "--replays", "0", "--json")
    assert code == 0, err
    assert json.loads(out)["bytes"] == (tmp_path / "r.html").stat().st_size
    code, _, err = cli("report", tmp_path, "--out", tmp_path / "r.html")
    assert code == 2 and "expected the folder of a finished run of evaluate, exploit, curve, rank or train" in err
    assert cli("report", folder / "run", "--replays", "13")[0] == 2


def test_the_command_is_named_as_it_is_typed():
    assert tidied(f"{ROOT}/trust_env/training/cli/__main__.py evaluate --seed 3") == "trust-env evaluate --seed 3"
    assert tidied("/usr/bin/trust-env evaluate") == "trust-env evaluate"
    assert tidied("study.py --fast") == "study.py --fast"
