"""The overview of an evaluation: one table of 80 columns, what it means, and an episode again."""

from __future__ import annotations

import io
import shlex

import numpy as np
import pytest
from rich.console import Console

import trust_env
from trust_env import training
from trust_env.metrics import METRICS, EpisodeMetrics
from trust_env.training.evaluation.overview import COLUMNS, print_overview
from trust_env.training.evaluation.replay_code import Setting, worst_world
from trust_env.training.evaluation.results import Results


@pytest.fixture(scope="module")
def results() -> Results:
    """At a level of knowledge above the scenario's, with a field changed and episodes cut short."""
    attacks, defenses = "honest,optimal_false_positive(n=1)", "score,trust(preset=cdc2024, trusted=[1])"
    options = {"max_cycles": 30, "overrides": {"tracker.gate": 0.95}, "progress": False}
    return training.evaluate("trio(horizon=50)", attacks, defenses, 5, 3, knowledge="picture", **options)


def printed(results: Results, width: int) -> str:
    console = Console(width=width, file=io.StringIO(), record=True)
    print_overview(results, console)
    return console.export_text()


@pytest.mark.parametrize("width", [80, 100, 200])
def test_the_overview_is_one_table_that_fits_and_explains_its_columns(results, width):
    text = printed(results, width)
    table = text.split("trio, seed 3:")[0].splitlines()
    assert max(map(len, table)) <= width
    assert sum("damage" in line for line in table) == 1 and "…" not in text
    assert all(f"  {column.heading}" in text for column in COLUMNS.values())
    assert {name for name in COLUMNS if name != "worst"} <= set(METRICS)


def test_the_overview_shows_means_their_interval_and_the_worst_tenth(results):
    summary = results["optimal_false_positive(n=1)", "score"].summary["damage_per_frame"]
    rows = printed(results, 200).splitlines()
    at = next(i for i, line in enumerate(rows) if line.startswith("optimal_false_positive(n=1)  score "))
    assert rows[at].split()[-6:-4] == [f"{summary.mean:.2f}", f"{summary.worst_decile:.2f}"]
    assert rows[at].split()[-2:] == ["–", "–"]  # `score` has no opinion of agents
    assert rows[at + 1].split() == [f"{summary.mean_low:.2f}–{summary.mean_high:.2f}"]


def test_the_replay_code_of_a_row_begins_the_episode_that_its_table_measured(results):
    cell = results["optimal_false_positive(n=1)", "trust(preset=cdc2024, trusted=[1])"]
    world = worst_world(cell, "damage_per_frame")
    assert cell.metrics["damage_per_frame"][world] == cell.metrics["damage_per_frame"].max()
    names: dict = {"trust_env": trust_env}
    exec(results.replay_code(cell, world), names)
    env, player, observations = names["env"], names["player"], names["observations"]
    assert env.scenario.knowledge == "picture" == results.to_dict()["knowledge"]
    metrics = EpisodeMetrics(env)
    while env.agents:
        observations, *_ = env.step(player.actions(observations))
        metrics.update()
    replayed = {name: values[0] for name, values in metrics.result().items()}
    assert replayed == pytest.approx({n: v[world] for n, v in cell.metrics.items()}, abs=0, nan_ok=True)


def test_the_command_of_a_replay_shows_the_episode_that_the_table_measured(results, cli, tmp_path):
    line = next(line for line in printed(results, 80).splitlines() if line.startswith("  trust-env replay "))
    code, out, err = cli(*shlex.split(line)[1:], "--out", tmp_path / "a.html")
    assert code == 0, err
    worst = max(cell.metrics["damage_per_frame"].max() for cell in results.cells)
    assert f"damage per frame {worst:.3g}" in out


def test_a_row_of_a_folder_is_named_by_its_number(cli, tmp_path):
    options = ("--scenario", "trio", "--max-cycles", "20", "--episodes", "3", "--out", tmp_path / "run")
    _, out, _ = cli("evaluate", "--attack", "false_positive", "--defense", "score,trust", *options)
    line = next(line for line in out.splitlines() if line.startswith("  trust-env replay "))
    words = shlex.split(line)[1:]
    code, out, err = cli(*words, "--out", tmp_path / "a.html")
    assert code == 0 and "as in its row" in out, err


def test_commands_on_a_folder_name_the_code_that_they_play(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cli("new", "defense", "mine")
    options = ("--scenario", "trio", "--max-cycles", "20", "--episodes", "3", "--out", "run")
    _, out, _ = cli("evaluate", "--attack", "false_positive", "--defense", "mine.py:Mine(window=2),score", *options)
    lines = [line for line in out.splitlines() if line.startswith("  trust-env ")]
    assert lines[1] == "  trust-env report run --defense 'mine.py:Mine(window=2)'"
    code, out, err = cli("replay", "run", "--row", "0", "--defense", "mine.py:Mine(window=2)")
    assert code == 0 and "as in its row" in out, err
    assert cli("replay", "run", "--row", "0")[0] == cli("replay", "run", "--row", "0", "--defense", "score")[0] == 2
    code, out, err = cli(*shlex.split(lines[1])[1:])
    assert code == 0 and "6 replays" in out and "not replayed" not in out, err
    code, out, err = cli("report", "run")
    assert code == 0 and out.count("expected --defense 'mine.py:Mine(window=2)' too") == 2, err
    assert "not replayed: beside false_positive x score: " in out and "3 replays" in out


def test_a_knowledge_level_that_an_attack_needs_stands_in_the_code_and_in_the_results():
    options = {"episodes": 1, "max_cycles": 2, "progress": False}
    found = training.evaluate("patrol", "fov_aware", "score", **options)
    assert found.knowledge == "poses" == found.setting.changes["knowledge"]
    assert training.evaluate("trio", "honest", "score", **options).setting == Setting("trio", {}, 2)
    of_mapping = training.evaluate({"base": "trio"}, "honest", "score", **options)
    assert "parallel_env(scenario, 'score', max_cycles=2)" in of_mapping.replay_code(("honest", "score"), 0)


def test_the_worst_world_is_the_highest_or_the_lowest_by_the_metric(results):
    cell = results["honest", "score"]
    values = {"damage_per_frame": [1.0, 3.0, 3.0], "siap_completeness": [0.5, np.nan, 0.2]}
    other = type(cell)("a", "b", {name: np.array(v) for name, v in values.items()}, {}, ())
    assert worst_world(other, "damage_per_frame") == 1
    assert worst_world(other, "siap_completeness") == 2
