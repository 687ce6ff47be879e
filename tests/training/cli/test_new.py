"""`trust-env new`: what it writes runs as it is."""

from __future__ import annotations

import json
import re
import shlex

import pytest
from documents import DOCUMENTS
from language_server import MODELINE

import trust_env
from trust_env.agents import Player
from trust_env.scenario.json_schema import scenario_schema

SHORT = ("--max-cycles", "25", "--episodes", "3")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", ["defense", "attack", "scenario"])
def test_the_commands_that_it_prints_run_on_what_it_wrote(cli, kind):
    code, out, err = cli("new", kind, "third_try", "--json")
    assert code == 0, err
    written = json.loads(out)
    assert written["file"] == ("third_try.yaml" if kind == "scenario" else "third_try.py")
    for line in written["next"]:
        command = shlex.split(line)[1:]
        if command[0] == "evaluate":
            command = [word for word in command if word not in ("--episodes", "20")] + list(SHORT)
        if command[0] == "conform":
            command += ["--max-seconds", "0.5"]
        code, out, err = cli(*command)
        assert code == 0, err


def test_the_new_defense_hides_what_its_agents_contradict(cli):
    cli("new", "defense", "Votes")
    _, out, _ = cli(
        "evaluate", "--attack", "false_positive", "--defense", "score,votes.py:Votes", "--episodes", "8", "--json"
    )
    score, votes = (cell["metrics"] for cell in json.loads(out)["cells"])
    assert votes["injected_tracks_per_frame"]["mean"] < 0.7 * score["injected_tracks_per_frame"]["mean"]
    assert votes["adversary_auroc"]["mean"] > 0.5


def test_the_new_attack_injects_tracks_and_does_not_depend_on_the_batch(cli):
    cli("new", "attack", "points.py")
    venv = trust_env.vector_env("patrol", "score", num_worlds=4, autoreset=False)
    player = Player(venv, {"adversary": "points.py:Points(n=2, start=5)"})
    observations, _ = venv.reset(seed=1)
    for _ in range(20):
        actions = player.actions(observations)
        observations, *_, info = venv.step(actions)
    assert info["injected_tracks"].mean() > 1.0
    alone = trust_env.vector_env("patrol", "score", num_worlds=1, autoreset=False)
    player = Player(alone, {"adversary": "points.py:Points(n=2, start=5)"})
    observations, _ = alone.reset(seed=1, options={"worlds": [2], "episodes": [0]})
    for _ in range(20):
        last = player.actions(observations)
        observations, *_ = alone.step(last)
    assert (last[0] == actions[2]).all()


def test_the_new_scenario_has_its_name(cli, folder):
    cli("new", "scenario", "sub/harbour")
    scenario = trust_env.load_scenario(folder / "sub" / "harbour.yaml")
    assert (scenario.name, scenario.roles[0], len(scenario.roles)) == ("harbour", "adversary", 4)


def test_a_new_scenario_names_the_schema_that_is_written_beside_it(cli, folder):
    assert cli("new", "scenario", "sub/mine")[0] == 0
    text = (folder / "sub" / "mine.yaml").read_text()
    assert text.startswith("#")  # the server reads the line wherever it stands, people look at the top
    (named,) = MODELINE.findall(text)
    assert json.loads((folder / "sub" / named).read_text()) == scenario_schema()
    assert trust_env.load_scenario(folder / "sub" / "mine.yaml").name == "mine"


def test_the_documentation_names_the_file_that_its_command_writes():
    (page,) = [each for each in DOCUMENTS if each.name == "scenario.md"]
    spans = re.findall(r"`([^`\n]+)`", page.read_text("utf-8"))
    (written,) = [span.split(" > ")[1] for span in spans if span.startswith("trust-env scenarios schema > ")]
    assert [named for span in spans for named in MODELINE.findall(span)] == [written]


def test_nothing_is_overwritten_and_names_are_names(cli, folder):
    (folder / "mine.py").write_text("kept")
    code, _, err = cli("new", "attack", "mine")
    assert code == 2 and "mine.py: File exists" in err
    assert (folder / "mine.py").read_text() == "kept"
    code, _, err = cli("new", "defense", "2nd try")
    assert code == 2 and "expected a name of letters" in err
