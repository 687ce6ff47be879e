"""`evaluate`: its options, what it prints and writes, and its errors."""

import json
import re
import signal
import subprocess
import sys
import time
from functools import partial

import pytest
from paths import ROOT

from trust_env.metrics import METRICS

PROGRAM = [sys.executable, "-m", "trust_env.training.cli"]
SMALL = ("--scenario", "trio", "--max-cycles", "15", "--episodes", "4")


def test_the_printed_json_is_what_is_written(cli, tmp_path):
    code, out, err = cli("evaluate", *SMALL, "--defense", "score,trust", "--out", tmp_path / "out", "--json")
    assert code == 0, err
    printed = json.loads(out)
    assert printed == json.loads((tmp_path / "out" / "results.json").read_text())
    assert [(cell["attack"], cell["defense"]) for cell in printed["cells"]] == [
        ("honest", "score"),
        ("honest", "trust(preset=paper)"),
    ]


def test_tables_fit_the_width_of_the_terminal(cli, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    attacks = "honest,sleeper(start=5, inner=false_positive(n=2)),fov_aware"
    code, out, _ = cli("evaluate", *SMALL, "--attack", attacks, "--defense", "score,trust", "--metric", "all")
    assert code == 0
    assert max(map(len, out.splitlines())) <= 80
    assert all(word in out for word in ("honest", "fov_aware", "missing", "fraction", "95 %"))
    assert "knowledge: own in the scenario, poses here for all cells" in out
    _, out, _ = cli("evaluate", *SMALL, "--metric", "gospa,ospa")
    assert "gospa" in out
    assert "missing" not in out


def test_set_takes_yaml_values_that_reach_the_scenario(cli):
    """Nothing is detected and nothing is clutter: no picture, and all targets in view are missing."""
    fields = ("sensor.p_detect=1e-9", "clutter_density=0", "tracker.beta_fp=1e-6")
    settings = [word for field in fields for word in ("--set", field)]
    code, out, _ = cli("evaluate", *SMALL, *settings, "--json")
    metrics = json.loads(out)["cells"][0]["metrics"]
    assert code == 0
    assert set(metrics["missing_fraction"].values()) == {1.0}
    assert metrics["false_tracks_per_frame"]["iqm"] == 0.0
    assert "track_auroc" not in metrics


def test_actuation_and_knowledge_reach_the_scenario(cli):
    arguments = ("evaluate", *SMALL, "--attack", "optimal_false_positive", "--json")
    shown = {}
    for actuation in ("monitor", "filter"):
        _, out, _ = cli(
            *arguments, "--actuation", actuation, "--knowledge", "white_box", "--defense", "majority(q=0.9)"
        )
        shown[actuation] = json.loads(out)["cells"][0]["metrics"]["injected_tracks_per_frame"]["iqm"]
    assert shown["monitor"] > shown["filter"]


def test_data_names_the_recording_that_is_played(cli, tmp_path):
    rows = [f"{t},{name},{x + 100 * t},{y}" for t in range(0, 300, 10) for name, x, y in (("a", 0, 0), ("b", 0, 9000))]
    (tmp_path / "traffic.csv").write_text("\n".join(["t,id,x,y", *rows]) + "\n")
    arguments = ("--scenario", "skies", "--data", tmp_path / "traffic.csv", "--episodes", "3", "--json")
    code, out, err = cli("evaluate", *arguments, "--set", "team.placement=together")
    assert code == 0, err
    found = json.loads(out)["cells"][0]["metrics"]
    assert found["missing_fraction"]["iqm"] < 0.2


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("--attack", "false_positiv"), "did you mean 'false_positive'"),
        (("--attack", "suppress(fraction=2)"), "suppress: fraction = 2: expected"),
        (("--attack", "suppress(fraction=1"), "a ) is missing at the end"),
        (("--defense", "trust(presett=mate)"), "unknown switch of trust 'presett'"),
        (("--defense", "no_file.py:Mine"), "there is no file"),
        (("--scenario", "nowhere.yaml"), "nowhere.yaml: there is no such file"),
        (("--scenario", "skies"), "targets.data"),
        (("--scenario", "skies", "--data", "none.csv"), "none.csv: there is no such file"),
        (("--set", "tracker.gat=0.9"), "did you mean 'tracker.gate'?"),
        (("--set", "tracker.gate=high"), "tracker.gate = 'high' (override): expected"),
        (("--set", "tracker.gate=[1"), "--set tracker.gate=[1"),
        (("--set", "tracker.gate"), "expected FIELD=VALUE"),
        (("--set", "dt=1", "--set", "dt=2"), "dt is given twice"),
        (("--metric", "gospar"), "unknown metric 'gospar'; did you mean 'gospa'?"),
        (("--episodes", "0"), "episodes must be a whole number of at least 1; got 0"),
        (("--max-cycles", "-3"), "max_cycles must be a whole number of at least 1; got -3"),
        (("--seed", "-1"), "seed must be an integer"),
        (("--resume",), "expected --out too"),
        (("--out", "/dev/null/results"), "/dev/null/results: Not a directory"),
    ],
)
def test_wrong_input_gives_one_message_and_exit_code_2(cli, arguments, text):
    code, out, err = cli("evaluate", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("trust-env: error: ")
    assert text in err
    assert "Traceback" not in err


def test_a_folder_with_results_is_resumed_only_with_the_same_configuration(cli, tmp_path):
    arguments = ("evaluate", *SMALL, "--out", tmp_path / "out")
    assert cli(*arguments)[0] == 0
    code, _, err = cli(*arguments)
    assert code == 2
    assert f"{tmp_path}/out: the folder is not empty" in err
    assert cli(*arguments, "--resume")[0] == 0
    code, _, err = cli(*arguments, "--resume", "--seed", "5")
    assert code == 2
    assert "seed is 0 there, 5 here" in err


def test_ctrl_c_has_exit_code_130_and_says_how_to_resume(tmp_path):
    out = tmp_path / "out"
    options = ["--attack", "honest,random", "--episodes", "2000", "--out", str(out)]
    # Jobs in the background are started with SIGINT ignored.
    restore_sigint = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    command = [*PROGRAM, "evaluate", *options]
    running = subprocess.Popen(command, cwd=ROOT, preexec_fn=restore_sigint, **pipes)
    deadline = time.monotonic() + 60
    while not (out / "results.json").exists() and time.monotonic() < deadline:
        time.sleep(0.01)  # until it is about to play
    running.send_signal(signal.SIGINT)
    _, err = running.communicate(timeout=60)
    assert running.returncode == 130
    assert "trust-env: interrupted" in err
    assert "--resume continues" in err
    assert "Traceback" not in err


def test_every_metric_can_be_asked_for_by_its_name(cli):
    _, out, _ = cli("evaluate", *SMALL, "--metric", ",".join(METRICS), "--json")
    assert set(json.loads(out)["cells"][0]["metrics"]) <= set(METRICS)
    assert re.fullmatch(r"[a-z_]+", "".join(METRICS))
