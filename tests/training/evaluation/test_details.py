"""What courses.parquet holds: courses of frames against a plain replay, and scores against the metrics."""

import numpy as np
import pyarrow.parquet as pq
import pytest

from trust_env import training
from trust_env.metrics.agent_record import N_SCORES, AgentRecord
from trust_env.metrics.course_record import COURSES, CourseRecord
from trust_env.training.evaluation.details import Details, details_in, details_of, to_arrow
from trust_env.training.evaluation.run_folder import DETAILS, read_details

TRIO = {"base": "trio", "horizon": 12}
NAN = float("nan")


def test_a_frame_s_course_is_damage_its_parts_and_trust_by_role():
    record = CourseRecord(np.array([True, False, False]))
    values = {"false_tracks": np.array([3.0, 0.0]), "injected_tracks": np.array([2.0, 0.0])}
    values["missing_targets"] = np.array([1.0, 4.0])
    record.update(values, np.array([[0.2, 0.8, 0.6], [NAN, 0.5, NAN]]))
    found = {name: course[:, 0].tolist() for name, course in record.result().items()}
    assert found["damage"] == [4.0, 4.0] and found["injected"] == [2.0, 0.0] and found["missing"] == [1.0, 4.0]
    assert found["adversary_trust"] == pytest.approx([0.2, NAN], nan_ok=True)
    assert found["benign_trust"] == pytest.approx([0.7, 0.5])


def test_statistics_are_over_the_episodes_that_define_the_value():
    first = {name: np.array([[1.0, NAN], [2.0, NAN]]) for name in COURSES}
    second = {name: np.array([[6.0, NAN], [NAN, NAN], [11.0, NAN]]) for name in COURSES}
    found = details_of([first, second], [np.full((2, N_SCORES), 1), np.full((2, N_SCORES), 2)])
    # of 1, 2, 6 and 11, at 0.3, 1.5 and 2.7 steps between them
    assert found.courses["damage"][0] == pytest.approx([5.0, 1.3, 4.0, 9.5])
    assert np.isnan(found.courses["damage"][1]).all()
    assert (found.scores == 3).all()


def test_agents_are_counted_by_their_mean_trust_an_adversary_s_from_its_first_edit_on():
    record = AgentRecord(1, np.array([True, True, False]), 0.4, 3)
    record.update(1, np.array([[0.9, 0.9, 1.0]]), np.array([[0, 0, 0]]))
    record.update(2, np.array([[0.1, 0.305, 1.0]]), np.array([[2, 0, 0]]))
    adversaries, others = record.score_counts()
    assert np.flatnonzero(adversaries).tolist() == [10]  # 0.1 since its edit
    assert np.flatnonzero(others).tolist() == [60, 99]  # 0.6025, and 1 in the last part


def test_details_are_read_back_as_they_were_written():
    details = {
        ("a", "trust"): Details({n: np.array([[1.0, 0.5, NAN, 2.0]] * 3) for n in COURSES}, np.eye(2, N_SCORES)),
        ("b", "trust"): Details({n: np.full((2, 4), 7.0) for n in COURSES}, np.zeros((2, N_SCORES), int)),
    }  # fmt: skip
    found = details_in(to_arrow(details))
    assert list(found) == list(details)
    for key, each in details.items():
        assert np.array_equal(found[key].scores, each.scores)
        assert all(np.array_equal(found[key].courses[n], each.courses[n], equal_nan=True) for n in COURSES)
    assert details_in(to_arrow({})) == {}


def test_courses_of_a_run_are_means_over_its_episodes_frame_by_frame(tmp_path):
    training.evaluate(TRIO, "false_positive", "trust", 3, 5, out=tmp_path / "run", progress=False)
    details, _ = read_details(tmp_path / "run")
    (found,) = details.values()
    scenes = [training.replay(tmp_path / "run", row)[0].scenes for row in range(3)]
    for t in range(12):
        metrics = [scene[t].metrics for scene in scenes]
        damage = [m["false_tracks"] + m["missing_targets"] for m in metrics]
        assert found.courses["damage"][t, 0] == pytest.approx(np.mean(damage))
        assert found.courses["damage"][t, 2] == np.median(damage)
        trust = [np.mean([a.trust for a in scene[t].agents if not a.adversary]) for scene in scenes]
        assert found.courses["benign_trust"][t, 0] == pytest.approx(np.mean(trust))


def test_a_resumed_run_keeps_the_courses_of_what_was_finished_and_its_command(tmp_path, monkeypatch):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    monkeypatch.setattr("sys.argv", ["trust-env", "evaluate", "--first"])
    training.evaluate(TRIO, "honest,random", "score", 2, out=whole, progress=False)
    parts.mkdir()
    table = pq.read_table(whole / "results.parquet")
    training.evaluate(TRIO, "honest,random", "score", 2, out=parts, progress=False)
    metadata = {**table.schema.metadata, b"trust_env.strata": _first_strata(table)}
    pq.write_table(table.slice(0, 2).replace_schema_metadata(metadata), parts / "results.parquet")
    monkeypatch.setattr("sys.argv", ["trust-env", "evaluate", "--resume"])
    training.evaluate(TRIO, "honest,random", "score", 2, out=parts, resume=True, progress=False)
    assert (parts / DETAILS).read_bytes() == (whole / DETAILS).read_bytes()
    assert read_details(parts)[1] == "trust-env evaluate --first"


def _first_strata(table):
    import json

    return json.dumps(json.loads(table.schema.metadata[b"trust_env.strata"])[:1])


def test_a_folder_without_courses_can_be_resumed_and_a_damaged_one_is_named(tmp_path):
    training.evaluate(TRIO, "honest", "score", 2, out=tmp_path / "run", progress=False)
    (tmp_path / "run" / DETAILS).unlink()
    found = training.evaluate(TRIO, "honest", "score", 2, out=tmp_path / "run", resume=True, progress=False)
    assert found.cells[0].details is None
    (tmp_path / "run" / DETAILS).write_bytes(b"nothing")
    with pytest.raises(ValueError, match="not the courses of an evaluation"):
        training.evaluate(TRIO, "honest", "score", 2, out=tmp_path / "run", resume=True, progress=False)
