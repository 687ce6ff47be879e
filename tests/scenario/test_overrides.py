"""Overrides: by dotted path or last name, from Python or in brackets, and what is wrong with one."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from trust_env.scenario import ScenarioError, load_scenario


def test_overrides_name_fields_by_dotted_path_or_last_name() -> None:
    scenario = load_scenario("patrol", **{"tracker.p_detect": 0.8}, gate=np.float64(0.95), radius=np.int64(9))
    assert (scenario.tracker.p_detect, scenario.tracker.gate, scenario.fov.radius) == (0.8, 0.95, 9.0)
    assert scenario.sensor.p_detect == 0.9
    assert load_scenario("patrol(tracker.gate=0.9)").tracker.gate == 0.9
    assert load_scenario("patrol", tracker={"gate": 0.9}).tracker.alpha == 1e-4
    assert load_scenario("patrol", order="adversaries_last").roles[0] == "benign"
    assert load_scenario("patrol", order=1).metrics.order == 1.0
    assert load_scenario("theorem", sigma=2.0).agent(0).sensor.covariance == ((4.0, 0.0), (0.0, 4.0))


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        (
            "patroll",
            "unknown scenario 'patroll'; did you mean 'patrol'? known: case1, case1_fn, case2, case2_fn, crowd, patrol",
        ),
        ("patrol(gaet=1)", "patrol: gaet = 1 (override): unknown field; did you mean 'tracker.gate'?"),
        ("patrol(tracker.gaet=1)", "unknown field; did you mean 'tracker.gate'?"),
        (
            "patrol(p_detect=1)",
            "several fields have this name; expected one of sensor.p_detect, tracker.p_detect",
        ),
        ("patrol(gate=2)", "patrol: tracker.gate = 2 (override): expected a number from 1e-15 to below 1"),
        ("patrol(gate=nan)", "patrol: tracker.gate = 'nan' (override): expected a number"),
        (
            "patrol(order=x)",
            "team.order = 'x' (override): expected one of adversaries_first, adversaries_last",
        ),
        ("patrol(horizon=0)", "horizon = 0 (override): expected a whole number from 1 to 1000000000"),
        ("patrol(horizon=None)", "targets.data = null"),
        ("patrol(evidence=5)", "evidence = 5 (override): expected a mapping of fields"),
        ("patrol(9)", "'9' has no name; expected key=value"),
        ("case1(n_benign=3)", "case1: team.n_benign = 3 (override): agents decides this here"),
        ("case1(targets.slots=3)", "targets.slots = 3 (override): targets.positions decides this here"),
        ("patrol.txt", "a file's name ends in .yaml"),
    ],
)
def test_wrong_overrides_are_named_with_what_was_expected(error_of, source: str, expected: str) -> None:
    assert expected in error_of(source)


def test_all_wrong_overrides_are_listed_at_once() -> None:
    with pytest.raises(ScenarioError) as caught:
        load_scenario("patrol", foo=1, bar=2)
    assert len(caught.value.problems) == 2
    assert pickle.loads(pickle.dumps(caught.value)).problems == caught.value.problems
    assert isinstance(caught.value, ValueError)
