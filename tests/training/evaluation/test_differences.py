"""Defenses compared with one of them."""

from __future__ import annotations

import json

import numpy as np
import pytest

from trust_env import training
from trust_env.training.evaluation.differences import differences
from trust_env.training.evaluation.statistics import simultaneous

TRIO = {"base": "trio", "horizon": 15}


@pytest.fixture(scope="module")
def results():
    return training.evaluate(TRIO, "honest,false_positive", "score,trust,majority", 6, progress=False)


def test_rows_are_means_of_paired_differences_with_simultaneous_intervals(results):
    rows = differences(results, "trust")
    assert [(row.attack, row.defense) for row in rows] == [
        (a, d) for a in ("honest", "false_positive") for d in ("score", "majority")
    ]
    damage = {cell.key: cell.metrics["damage_per_frame"] for cell in results.cells}
    expected = simultaneous([damage[r.attack, r.defense] - damage[r.attack, "trust(preset=paper)"] for r in rows])
    assert [row.difference for row in rows] == expected
    row = rows[2]
    assert row.damage == pytest.approx(np.mean(damage["false_positive", "score"]))
    assert row.ratio == pytest.approx(row.damage / row.reference)


def test_a_defense_that_was_not_played_is_refused(results):
    with pytest.raises(ValueError, match="unknown defense of this evaluation 'quorum'"):
        differences(results, "quorum")
    alone = training.evaluate(TRIO, "honest", "score", 2, progress=False)
    with pytest.raises(ValueError, match="no other defense than score"):
        differences(alone, "score")


def test_the_command_prints_them_on_request(cli):
    options = ("evaluate", "--scenario", "trio(horizon=10)", "--episodes", "4", "--defense", "score,trust")
    code, out, _ = cli(*options, "--against", "score")
    assert code == 0 and "Mean damage against that of score" in out and "hold for all rows at once" in out
    code, out, _ = cli(*options, "--against", "score", "--json")
    (row,) = json.loads(out)["against"]
    assert row["defense"] == "trust(preset=paper)" and set(row["difference"]) == {"value", "low", "high"}
    assert cli(*options, "--against", "trsut")[0] == 2
