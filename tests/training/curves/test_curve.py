"""`curve`: the same episodes at every value of a condition, in a folder that goes on, as table and figure."""

from __future__ import annotations

import json

import pyarrow.parquet as pq
import pytest

from trust_env import training
from trust_env.scenario import ScenarioError

TRIO = {"base": "trio", "horizon": 12}
SMALL = {"scenario": TRIO, "attacks": "honest,false_positive", "defenses": "score", "episodes": 4, "progress": False}


def test_every_value_is_the_evaluation_of_a_scenario_with_that_value():
    found = training.curve("adversaries", [0, 2], **SMALL)
    alone = training.evaluate(
        TRIO, SMALL["attacks"], "score", 4, overrides={"team.n_adversaries": 2, "team.n_benign": 1}, progress=False
    )
    expected = alone["false_positive", "score"].summary["damage_per_frame"]
    assert found.summary("false_positive", "score", 2) == expected
    without = found.summary("false_positive", "score", 0)
    assert without == found.summary("honest", "score", 0) and without != expected


@pytest.mark.parametrize(
    ("over", "field"),
    [
        ("p_detect", "sensor.p_detect"),
        ("clutter", "tracker.beta_fp"),
        ("spread", "team.spread"),
        ("slots", "injection.slots"),
    ],
)
def test_conditions_have_values_of_their_own_that_change_what_is_played(over: str, field: str):
    from trust_env.training.curves.axes import AXES

    world = training.evaluation.evaluate.load_scenario(TRIO)
    values = AXES[over].values(world)
    assert all(field in AXES[over].fields(world, value) for value in values)
    found = training.curve(over, [values[0], values[-1]], **{**SMALL, "attacks": "random"})
    first, last = (found.summary("random", "score", value) for value in found.values)
    assert first != last


def test_any_field_of_the_scenario_can_be_the_condition():
    found = training.curve("tracker.fusion", ["sequential", "trimmed_mean"], metric="gospa", **SMALL)
    assert found.summary("honest", "score", "sequential") != found.summary("honest", "score", "trimmed_mean")


def test_a_curve_goes_on_with_more_values_and_keeps_what_is_finished(tmp_path):
    first = training.curve("slots", [1], out=tmp_path / "c", **SMALL)
    kept = (tmp_path / "c" / "points" / "slots=1" / "results.parquet").read_bytes()
    both = training.curve("slots", [1, 4], out=tmp_path / "c", resume=True, **SMALL)
    assert (tmp_path / "c" / "points" / "slots=1" / "results.parquet").read_bytes() == kept
    assert both.summary("false_positive", "score", 1) == first.summary("false_positive", "score", 1)
    saved = json.loads((tmp_path / "c" / "curve.json").read_text())
    assert [point["value"] for point in saved["points"]] == [1, 4]
    assert pq.read_table(tmp_path / "c" / "curve.parquet").num_rows == 2 * 2 * 4
    with pytest.raises(ValueError, match="belongs to another configuration"):
        training.curve("slots", [1], out=tmp_path / "c", resume=True, **{**SMALL, "episodes": 5})
    with pytest.raises(ValueError, match="--resume to continue the curve in it"):
        training.curve("slots", [1], out=tmp_path / "c", **SMALL)


def test_the_figure_shows_every_line_at_every_value(tmp_path):
    pytest.importorskip("matplotlib")
    from trust_env.training.curves.figure import curve_figure

    found = training.curve("slots", [1, 2], **{**SMALL, "defenses": "score,trust"}, out=tmp_path / "c")
    assert (tmp_path / "c" / "curve.png").stat().st_size > 10_000
    axes = curve_figure(found).axes
    assert [axis.get_title() for axis in axes] == ["honest", "false_positive"]
    drawn = [container.lines[0].get_ydata().tolist() for container in axes[1].containers]
    expected = [[found.summary("false_positive", d, v).mean for v in (1, 2)] for d in ("score", "trust")]
    assert drawn == expected


@pytest.mark.parametrize(
    ("over", "values", "expected"),
    [
        ("adversaries", [7], "adversaries = 7: expected a whole number from 0 to 3"),
        ("adversaries", [1.5], "adversaries = 1.5: expected a whole number"),
        ("slots", [], "values: expected at least one, each once"),
        ("slots", [1, 1], "values: expected at least one, each once"),
        ("tracker.gaet", [1], "did you mean"),
        ("tracker.gate", None, "expected --values too"),
    ],
)
def test_conditions_that_are_none_are_refused_before_anything_is_played(over, values, expected, tmp_path):
    with pytest.raises((ValueError, ScenarioError), match=expected):
        training.curve(over, values, out=tmp_path / "c", **SMALL)
    assert not (tmp_path / "c").exists()


def test_a_scenario_that_lists_its_agents_has_no_number_of_adversaries_to_choose():
    with pytest.raises(ValueError, match="case1 lists its agents one by one"):
        training.curve("adversaries", [1], **{**SMALL, "scenario": "case1"})


def test_the_command_prints_a_table_and_json(cli):
    options = ("--scenario", "trio(horizon=10)", "--episodes", "3", "--defense", "score")
    code, out, _ = cli("curve", *options, "--over", "actuation", "--values", "filter,monitor")
    assert code == 0 and all(word in out for word in ("filter", "monitor", "false_positive", "mean"))
    code, out, _ = cli("curve", *options, "--over", "slots", "--values", "1,2", "--json")
    assert [point["value"] for point in json.loads(out)["points"]] == [1, 2]
