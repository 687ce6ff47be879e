"""The program `trust-env`: its commands, its output for people and machines, and its errors."""

import json
import re
import signal
import subprocess
import sys
import time
from functools import partial

import pytest
import yaml
from paths import ROOT

import trust_env
from trust_env import training
from trust_env.agents import POLICIES
from trust_env.conformance import CHECKS
from trust_env.defenses.trust_presets import PRESETS
from trust_env.metrics import METRICS
from trust_env.training.cli.main import COMMANDS, main

PROGRAM = [sys.executable, "-m", "trust_env.training.cli"]


@pytest.fixture
def cli(capsys):
    """Run a command: its exit code, and what it wrote to stdout and stderr."""

    def run(*arguments):
        capsys.readouterr()
        try:
            code = main([str(a) for a in arguments])
        except SystemExit as stop:  # the parser's own
            code = stop.code
        written = capsys.readouterr()
        return code, written.out, written.err

    return run


# --- help and start ----------------------------------------------------------------------------------

GROUPS = {"scenarios": ("list", "show", "check"), "defenses": ("list", "show"), "attacks": ("list", "show")}
EVERY = [
    [],
    *[[name] for name in COMMANDS],
    *[[g] for g in GROUPS],
    *[[g, m] for g in GROUPS for m in GROUPS[g]],
]


@pytest.mark.parametrize("command", EVERY, ids=" ".join)
def test_every_command_has_help(cli, command):
    code, out, err = cli(*command, "--help")
    assert (code, err) == (0, "")
    assert " ".join(["usage: trust-env", *command]) in out
    if len(command) == 2 or "".join(command) in COMMANDS:
        assert "--json" in out


def test_all_promised_commands_are_there():
    assert set(COMMANDS) >= {"evaluate", "reproduce", "conform", "benchmark"}


def test_help_starts_at_once_and_loads_nothing_heavy():
    """Below 1.5 s on a quiet machine; here the best of three, as others may be using it."""
    times = []
    for _ in range(3):
        start = time.perf_counter()
        done = subprocess.run([*PROGRAM, "--help"], cwd=ROOT, capture_output=True, text=True, check=True)
        times.append(time.perf_counter() - start)
    assert "evaluate" in done.stdout
    assert min(times) < 1.5
    code = "import sys; from trust_env.training.cli import main; main.build_app(); print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert not {"torch", "numba", "scipy", "pettingzoo", "pyarrow", "matplotlib"} & set(loaded.stdout.split())


# --- what there is -----------------------------------------------------------------------------------


def test_lists_name_all_that_is_registered(cli):
    for group, names in (
        ("scenarios", trust_env.scenarios()),
        ("defenses", trust_env.defenses()),
        ("attacks", POLICIES),
    ):
        code, out, _ = cli(group, "list", "--json")
        listed = json.loads(out)
        assert code == 0
        assert [entry["name"] for entry in listed] == list(names)
        assert all(len(entry["description"]) > 20 for entry in listed)
        _, text, _ = cli(group, "list")
        assert [line.split()[0] for line in text.splitlines()] == list(names)


def test_every_entry_can_be_shown(cli):
    for name in trust_env.defenses():
        assert cli("defenses", "show", name)[0] == 0
    for name, policy in POLICIES.items():
        code, out, _ = cli("attacks", "show", name, "--json")
        shown = json.loads(out)
        assert (code, shown["name"], shown["knowledge"]) == (0, name, policy.knowledge)
    for name in trust_env.scenarios():
        assert yaml.safe_load(cli("scenarios", "show", name)[1])["name"] == name


def test_show_scenario_prints_yaml_that_loads_back(cli, tmp_path):
    _, out, _ = cli("scenarios", "show", "patrol(horizon=50, gate=0.95)")
    assert yaml.safe_load(out)["tracker"]["gate"] == 0.95
    (tmp_path / "copy.yaml").write_text(out)
    expected = trust_env.load_scenario("patrol(horizon=50, gate=0.95)")
    assert trust_env.load_scenario(tmp_path / "copy.yaml") == expected
    assert json.loads(cli("scenarios", "show", "patrol", "--json")[1])["horizon"] == 200


def test_show_defense_has_parameters_and_presets(cli):
    _, out, _ = cli("defenses", "show", "trust", "--json")
    shown = json.loads(out)
    assert shown["parameters"]["preset"] == {"default": "paper"}
    assert shown["parameters"]["epsilon"] == {"default": 0.01}
    assert shown["parameters"]["order"] == {
        "default": "tracks_first",
        "choices": ["tracks_first", "agents_first"],
    }
    assert list(shown["presets"]) == list(PRESETS)
    assert shown["presets"]["paper"] == {}
    assert shown["presets"]["cdc2024"]["strong_precision"] == 100.0
    _, text, _ = cli("defenses", "show", "majority")
    assert "  window = 10" in text
    assert "  q = 0.5" in text


def test_show_takes_what_is_in_a_file(cli, tmp_path):
    (tmp_path / "mine.py").write_text('class Mine:\n    "Mine alone."\n    def __init__(self, x, y=3): ...\n')
    _, out, _ = cli("defenses", "show", f"{tmp_path}/mine.py:Mine", "--json")
    assert json.loads(out) == {
        "name": "Mine",
        "doc": "Mine alone.",
        "parameters": {"x": {}, "y": {"default": 3}},
    }


def test_check_lists_all_problems_of_a_file(cli, tmp_path):
    file = tmp_path / "my.yaml"
    file.write_text("base: patrol\nhorizn: 3\ntracker: {gate: 1.5}\ndt: -1\n")
    code, out, err = cli("scenarios", "check", file)
    assert (code, out) == (1, "")
    assert "my.yaml, line 2: horizn = 3: unknown field; did you mean 'horizon'?" in err
    assert "my.yaml, line 3: tracker.gate = 1.5: expected a number below 1" in err
    assert "my.yaml, line 4: dt = -1: expected a number above 0" in err
    code, out, _ = cli("scenarios", "check", file, "patrol", "--json")
    found = json.loads(out)
    assert (code, found["ok"]) == (1, False)
    assert [len(problems) for problems in found["problems"].values()] == [3, 0]
    file.write_text("base: patrol\nhorizon: 3\n")
    assert cli("scenarios", "check", file) == (0, f"{file}: ok\n", "")


# --- evaluate ----------------------------------------------------------------------------------------

SMALL = ("--scenario", "trio", "--max-cycles", "15", "--episodes", "4")


def test_evaluate_prints_json_and_writes_the_same(cli, tmp_path):
    code, out, err = cli("evaluate", *SMALL, "--defense", "score,trust", "--out", tmp_path / "out", "--json")
    assert code == 0, err
    printed = json.loads(out)
    assert printed == json.loads((tmp_path / "out" / "results.json").read_text())
    assert [(cell["attack"], cell["defense"]) for cell in printed["cells"]] == [
        ("honest", "score"),
        ("honest", "trust"),
    ]


def test_evaluate_prints_a_table_that_fits(cli, monkeypatch):
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


def test_overrides_are_yaml_and_reach_the_scenario(cli):
    """Nothing is detected and nothing is clutter: no picture, and all targets in view are missing."""
    settings = (
        "--set",
        "sensor.p_detect=1e-9",
        "--set",
        "clutter_density=0",
        "--set",
        "tracker.beta_fp=1e-6",
    )
    code, out, _ = cli("evaluate", *SMALL, *settings, "--json")
    metrics = json.loads(out)["cells"][0]["metrics"]
    assert code == 0
    assert metrics["missing_fraction"] == {"iqm": 1.0, "low": 1.0, "high": 1.0}
    assert metrics["false_tracks_per_frame"]["iqm"] == 0.0
    assert "track_auroc" not in metrics


def test_actuation_and_knowledge_are_taken(cli):
    arguments = ("evaluate", *SMALL, "--attack", "optimal_false_positive", "--json")
    shown = {}
    for actuation in ("monitor", "filter"):
        _, out, _ = cli(
            *arguments, "--actuation", actuation, "--knowledge", "white_box", "--defense", "majority(q=0.9)"
        )
        shown[actuation] = json.loads(out)["cells"][0]["metrics"]["injected_tracks_per_frame"]["iqm"]
    assert shown["monitor"] > shown["filter"]


def test_a_recording_is_played(cli, tmp_path):
    rows = [
        f"{t},{name},{x + 100 * t},{y}"
        for t in range(0, 300, 10)
        for name, x, y in (("a", 0, 0), ("b", 0, 9000))
    ]
    (tmp_path / "traffic.csv").write_text("\n".join(["t,id,x,y", *rows]) + "\n")
    arguments = (
        "evaluate",
        "--scenario",
        "skies",
        "--data",
        tmp_path / "traffic.csv",
        "--episodes",
        "3",
        "--json",
    )
    code, out, err = cli(*arguments, "--set", "team.placement=together")
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
def test_wrong_input_is_one_message_and_exit_code_2(cli, arguments, text):
    code, out, err = cli("evaluate", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("trust-env: error: ")
    assert text in err
    assert "Traceback" not in err


@pytest.mark.parametrize(
    "arguments",
    [("evaluat",), ("evaluate", "--episodes", "x"), ("evaluate", "--actuation", "no"), (), ("scenarios",)],
)
def test_what_cannot_be_parsed_has_exit_code_2(cli, arguments):
    code, out, err = cli(*arguments)
    assert (code, out) == (2, "")
    assert "Traceback" not in err
    assert len(err) > 50


def test_a_folder_in_use_is_refused(cli, tmp_path):
    arguments = ("evaluate", *SMALL, "--out", tmp_path / "out")
    assert cli(*arguments)[0] == 0
    code, _, err = cli(*arguments)
    assert code == 2
    assert f"{tmp_path}/out: the folder is not empty" in err
    assert cli(*arguments, "--resume")[0] == 0
    code, _, err = cli(*arguments, "--resume", "--seed", "5")
    assert code == 2
    assert "seed is 0 there, 5 here" in err


def test_ctrl_c_has_exit_code_130_and_says_how_to_go_on(tmp_path):
    command = [
        *PROGRAM,
        "evaluate",
        "--attack",
        "honest,random",
        "--episodes",
        "2000",
        "--out",
        str(tmp_path / "out"),
    ]
    heeding = partial(
        signal.signal, signal.SIGINT, signal.SIG_DFL
    )  # jobs in the background ignore it from birth
    running = subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heeding
    )
    deadline = time.monotonic() + 60
    while not (tmp_path / "out" / "results.json").exists() and time.monotonic() < deadline:
        time.sleep(0.01)  # it is about to play
    running.send_signal(signal.SIGINT)
    _, err = running.communicate(timeout=60)
    assert running.returncode == 130
    assert "trust-env: interrupted" in err
    assert "--resume continues" in err
    assert "Traceback" not in err


def test_a_reader_that_leaves_is_no_error():
    command = (
        f"{sys.executable} -m trust_env.training.cli scenarios show crowd | head -1; exit ${{PIPESTATUS[0]}}"
    )
    done = subprocess.run(["bash", "-c", command], cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "name: crowd\n", "")


# --- conform and reproduce ---------------------------------------------------------------------------


def test_conform_reports_every_check(cli):
    arguments = ("conform", "--scenario", "trio(horizon=20)", "--defense", "score", "--max-seconds", "0.2")
    code, out, _ = cli(*arguments, "--attack", "fov_aware", "--json")
    found = json.loads(out)
    assert (code, found["ok"]) == (0, True)
    (report,) = found["environments"]
    assert report["environment"] == "trio x score"
    assert [check["name"] for check in report["checks"]] == list(CHECKS)
    assert not [check for check in report["checks"] if check["status"] == "failed"]


_ENVIRONMENTS = """
import numpy as np
from mpe2 import simple_spread_v3

def sound(max_cycles=25, render_mode=None):
    return simple_spread_v3.parallel_env(max_cycles=max_cycles, render_mode=render_mode)

class Drifting:
    "Observations that depend on how many environments there have been."
    made = 0
    def __new__(cls, max_cycles=25, render_mode=None):
        env = sound(max_cycles, render_mode)
        cls.made += 1
        step, offset = env.step, np.float32(1e-3 * cls.made)
        def drifting(actions):
            observations, *rest = step(actions)
            return {a: o + offset for a, o in observations.items()}, *rest
        env.step = drifting
        return env
"""


@pytest.mark.extra("bench")
def test_conform_takes_environments_of_ones_own(cli, tmp_path):
    (tmp_path / "envs.py").write_text(_ENVIRONMENTS)
    arguments = ("--max-seconds", "0.2", "--json")
    code, out, _ = cli("conform", "--env", f"{tmp_path}/envs.py:sound", *arguments)
    sound = {check["name"]: check["status"] for check in json.loads(out)["environments"][0]["checks"]}
    assert sound["whole_episode_determinism"] == sound["parallel_api_test"] == "passed"
    code, out, _ = cli("conform", "--env", f"{tmp_path}/envs.py:Drifting(max_cycles=10)", *arguments)
    found = {check["name"]: check["status"] for check in json.loads(out)["environments"][0]["checks"]}
    assert (code, found["whole_episode_determinism"]) == (1, "failed")


def test_conform_refuses(cli, tmp_path):
    (tmp_path / "envs.py").write_text("make_env = 3\n")
    for arguments, text in (
        (
            ("--env", f"{tmp_path}/envs.py:make_env"),
            "expected a function or class that returns a ParallelEnv",
        ),
        (("--env", f"{tmp_path}/envs.py:other"), "unknown name"),
        (("--env", "x.py:make", "--scenario", "trio"), "expected no scenario, defense or attack beside it"),
        (("--scenario", "skies"), "targets.data"),
        (("--attack", "nobody"), "unknown policy 'nobody'"),
    ):
        code, _, err = cli("conform", *arguments)
        assert code == 2
        assert text in err


class _Outcome:
    """Stands for what `reproduce` and `benchmark` return, which have tests of their own."""

    def __init__(self, ok, *given):
        self.ok, self.given = ok, given

    def to_dict(self):
        return {"ok": self.ok, "given": [str(g) for g in self.given]}

    def print(self, console):
        console.print(f"ok: {self.ok}")


@pytest.mark.parametrize(("command", "arguments", "given"), [
    ("reproduce", ("--out", "figures", "--seeds", "3"), ["figures", "3"]),
    ("benchmark", ("--quick",), ["True"]),
])  # fmt: skip
def test_reports_become_text_json_and_exit_codes(cli, monkeypatch, command, arguments, given):
    getattr(training, command)  # imports the module of that name
    module = sys.modules[getattr(training, command).__module__]
    for ok, code in ((True, 0), (False, 1)):
        monkeypatch.setattr(module, command, lambda *a, ok=ok: _Outcome(ok, *a))
        assert cli(command, *arguments) == (code, f"ok: {ok}\n", "")
        found = cli(command, *arguments, "--json")
        assert (found[0], json.loads(found[1])) == (code, {"ok": ok, "given": given})


def test_metrics_in_help_are_those_there_are(cli):
    """A name that the table shows is one that can be asked for."""
    _, out, _ = cli("evaluate", *SMALL, "--metric", ",".join(METRICS), "--json")
    assert set(json.loads(out)["cells"][0]["metrics"]) <= set(METRICS)
    assert re.fullmatch(r"[a-z_]+", "".join(METRICS))
