"""Results: damage placed between two references, and tables and files that agree."""

from __future__ import annotations

import io
import json

import numpy as np
import pyarrow.parquet as pq
import pytest
from rich.console import Console

from trust_env import training
from trust_env.metrics import METRICS
from trust_env.training.evaluation.cell import Cell
from trust_env.training.evaluation.detail_tables import print_reliability, print_strata
from trust_env.training.evaluation.results import Results, cells_of
from trust_env.training.evaluation.tables import print_results

NAN = float("nan")
TRUST = "trust(preset=paper)"  # the name in full


def results(**damage):
    """Cells of one attack by defense, of which damage per episode is all that is known."""
    n = len(next(iter(damage.values())))
    cells = tuple(
        Cell("a", defense, {m: np.full(n, NAN) for m in METRICS} | {"damage_per_frame": np.array(values)}, {}, ())
        for defense, values in damage.items()
    )
    return Results("patrol", 0, n, "trust_env_v0", cells)


def test_damage_is_placed_between_the_references_under_the_same_attack():
    found = results(oracle=[1.0, 2.0], blank=[5.0, 6.0], trust=[2.0, 3.0], score=[7.0, 8.0])
    places = {cell.defense: found.placed_damage(cell) for cell in found.cells}
    assert {name: place.value for name, place in places.items()} == pytest.approx(
        {"oracle": 0.0, "blank": 1.0, "trust": 0.25, "score": 1.5}
    )
    assert places["trust"] == pytest.approx((0.25, 0.25, 0.25))


def test_damage_is_placed_only_where_both_references_were_played_and_differ():
    for damage in (
        {"oracle": [1.0, 2.0], "trust": [2.0, 3.0]},
        {"oracle": [1.0, 2.0], "blank": [1.0, 2.0], "trust": [2.0, 3.0]},
        {"my_oracle": [1.0, 2.0], "blank": [5.0, 6.0], "trust": [2.0, 3.0]},
    ):
        found = results(**damage)
        assert all(found.placed_damage(cell) is None for cell in found.cells)


def test_the_reference_without_arguments_comes_first():
    found = results(**{"oracle(lone='show')": [0.0], "oracle": [1.0], "blank": [5.0], "trust": [2.0]})
    place = found.placed_damage(found["a", "trust"])
    assert place is not None and place.value == 0.25
    found = results(**{"oracle(lone='show')": [0.0], "blank": [4.0], "trust": [2.0]})
    place = found.placed_damage(found["a", "trust"])
    assert place is not None and place.value == 0.5


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    out = tmp_path_factory.mktemp("results") / "out"
    attacks = "honest,false_positive"
    options = {"scenario": "trio(horizon=30)", "episodes": 5, "progress": False}
    return training.evaluate(attacks=attacks, defenses="score,trust", out=out, **options), out


def printed(show, *arguments) -> str:
    console = Console(file=io.StringIO(), width=150)
    show(*arguments, console)
    return console.file.getvalue()


def test_files_hold_strata_and_reliability(played):
    found, out = played
    table = pq.read_table(out / "results.parquet")
    cells = cells_of(table, json.loads(table.schema.metadata[b"trust_env.strata"]))
    for cell, saved in zip(found.cells, cells, strict=True):
        assert saved.key == cell.key
        assert saved.to_dict() == cell.to_dict()
        for kind, bins in cell.reliability.items():
            np.testing.assert_array_equal(saved.reliability[kind], bins)
    written = json.loads((out / "results.json").read_text())
    assert [each["defense"] for each in written["pooled"]] == ["score", TRUST]
    assert [each["attacks"] for each in written["pooled"]] == [["honest", "false_positive"]] * 2
    assert "track_trust" not in written["pooled"][0]  # no opinion
    pools = [cell["pooled"]["track_trust"] for cell in written["cells"] if cell["defense"] == TRUST]
    together = written["pooled"][1]["track_trust"]
    assert together["forecasts"] == sum(each["forecasts"] for each in pools)
    weighted = sum(each["brier"] * each["forecasts"] for each in pools) / together["forecasts"]
    assert together["brier"] == pytest.approx(weighted)


def test_a_batch_more_or_less_gives_the_same_strata(played, monkeypatch):
    found, _ = played
    monkeypatch.setattr("trust_env.training.evaluation.evaluate.MAX_WORLDS", 2)
    options = {"scenario": "trio(horizon=30)", "episodes": 5, "progress": False}
    again = training.evaluate(attacks="false_positive", defenses="trust", **options).cells[0]
    for stratum, other in zip(found["false_positive", "trust"].strata, again.strata, strict=True):
        assert other == pytest.approx(stratum, abs=1e-12, nan_ok=True)


def test_tables_say_never_mean_and_worst_tenth(played):
    found, _ = played
    text = printed(print_results, found, ["damage_per_frame", "frames_to_first_false_track"])
    assert all(word in text for word in ("never", "100 %", "worst", "mean", "IQM"))
    assert METRICS["frames_to_first_false_track"].definition in " ".join(text.split())
    summary = found["false_positive", "score"].summary["damage_per_frame"]
    assert f"{summary.mean:.2f}" in text and f"{summary.worst_decile:.2f}" in text


def test_tables_place_damage_where_the_references_are():
    shown = results(oracle=[1.0, 2.0], blank=[5.0, 6.0], trust=[2.0, 3.0])
    assert "oracle: 0, blank: 1" in printed(print_results, shown, ["damage_per_frame"])
    assert "oracle: 0" not in printed(print_results, results(trust=[2.0, 3.0]), ["damage_per_frame"])


def test_strata_and_reliability_are_printed_for_every_cell(played):
    found, _ = played
    text = printed(print_strata, found)
    assert all(f"{cell.attack} x {cell.defense}" in text for cell in found.cells)
    rows = [line for line in text.splitlines() if line.startswith("│")]
    assert len(rows) == sum(len(cell.strata) for cell in found.cells)
    text = printed(print_reliability, found)
    assert all(f"{TRUST}, {kind}, all attacks" in text for kind in ("tracks", "agents"))
