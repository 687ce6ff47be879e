"""What a training run says when it is finished: its curve, the command that evaluates it; and runs of several seeds."""

from __future__ import annotations

import re
import shlex

import numpy as np
import pytest
from training_runs import ROLLOUT, SMALL, lines, same, train, weights

from trust_env.training.learning.configuration import load_configuration
from trust_env.training.learning.learning_curve import draw_curve, read_curve
from trust_env.training.learning.seeds import train_seeds

pytestmark = pytest.mark.extra("train")


def said_command(text: str) -> list[str]:
    (line,) = re.findall(r"^to compare: trust-env (.*)$", text, flags=re.MULTILINE)
    return shlex.split(line)


def test_the_command_that_a_run_prints_evaluates_it_on_its_scenario_against_its_defense(cli, tmp_path):
    found = train(out=tmp_path / "run", steps=1, defense="majority(window=5, q=0.5)")
    command = said_command(found.describe())
    assert command[:6] == [
        "evaluate",
        "--scenario",
        "trio(horizon=20)",
        "--defense",
        "majority(window=5, q=0.5)",
        "--attack",
    ]
    code, out, err = cli(*command, "--episodes", "2")
    assert code == 0, err
    assert "trio, seed 0" in out and "run" in out
    page = re.findall(r"^as a page: trust-env (.*)$", found.describe(), flags=re.MULTILINE)[0]
    code, out, err = cli(*shlex.split(page), "--out", tmp_path / "page.html")
    assert code == 0 and "page.html: " in out, err


def test_a_scenario_that_has_no_name_is_played_from_the_runs_folder(tmp_path):
    found = train(out=tmp_path / "run", steps=1, scenario={"base": "trio", "name": "mine", "horizon": 20})
    assert str(tmp_path / "run" / "scenario.yaml") in said_command(found.describe())


def test_a_benign_policy_is_played_by_a_player(tmp_path):
    found = train(out=tmp_path / "run", steps=1, overrides={"role": "benign"})
    assert "Player(env, {'benign': " in found.describe()


def test_by_default_there_are_ten_evaluations_and_more(tmp_path):
    config = {
        **SMALL,
        "steps": 20 * ROLLOUT,
        "evaluation": {"episodes": 1},
        "ppo": {"n_steps": 32, "batch_size": 512, "n_epochs": 1},
    }
    found = train(out=tmp_path / "run", config=config)
    steps = [int(row["steps"]) for row in lines(found.folder / "evaluations.csv")]
    assert steps == [2 * n * ROLLOUT for n in range(11)]
    assert load_configuration(overrides={"steps": 20_000_000}).evaluated_every == 250_000
    assert load_configuration(overrides={"evaluation.every": 7}).evaluated_every == 7


def test_time_left_is_said_where_no_bar_is_shown(tmp_path, capsys):
    train(out=tmp_path / "run", steps=3 * ROLLOUT, progress=True)
    said = [line for line in capsys.readouterr().err.splitlines() if " of 1,536 steps" in line]
    assert "left" not in said[0] and re.search(r", \d+ s left: damage", said[1]) and "left" not in said[-1]


def test_several_seeds_train_each_as_alone_and_go_on_where_they_are(run, tmp_path):
    out = tmp_path / "runs"
    found = train_seeds(2, out, config=SMALL, progress=False)
    assert [r.folder.name for r in found.runs] == ["seed_0", "seed_1"]
    assert same(weights(out / "seed_0"), weights(run.folder))
    assert not same(weights(out / "seed_1"), weights(run.folder))
    assert said_command(found.describe())[-1] == f"{out}/seed_0,{out}/seed_1,false_positive"
    again = train_seeds(2, out, config=SMALL, progress=False)
    assert [r.began_at for r in again.runs] == [r.steps for r in found.runs]
    with pytest.raises(ValueError, match="steps is 1300 there, 7 here"):
        train_seeds(2, out, config=SMALL, overrides={"steps": 7}, progress=False)


@pytest.mark.extra("plot")
def test_the_curve_shows_the_evaluations(run, tmp_path):
    steps, damage = read_curve(run.folder)
    assert steps.tolist() == [0, 2 * ROLLOUT, 3 * ROLLOUT]
    assert damage[-1] == run.evaluations[-1]["damage_per_frame"]
    assert (run.folder / "curve.png").read_bytes()[:4] == b"\x89PNG"
    assert draw_curve([run.folder, run.folder], tmp_path / "both.png")
    assert np.frombuffer((tmp_path / "both.png").read_bytes()[16:24], ">u4").tolist() == [720, 432]
