"""The program `trust-env`: help, what starting it loads, exit codes."""

import subprocess
import sys

import pytest
from paths import ROOT

import trust_env
from trust_env.training.cli.main import COMMANDS
from trust_env.training.cli.options import Group

PROGRAM = [sys.executable, "-m", "trust_env.training.cli"]
PATHS = [[], *([name] for name in COMMANDS)]
for group, command in COMMANDS.items():
    PATHS += [[group, name] for name in command.commands] if isinstance(command, Group) else []


@pytest.mark.parametrize("path", PATHS, ids=" ".join)
def test_every_command_has_help(cli, path):
    code, out, err = cli(*path, "--help")
    assert (code, err) == (0, "")
    assert " ".join(["usage: trust-env", *path]) in out
    if len(path) == 2 or (path and not isinstance(COMMANDS[path[0]], Group)):
        assert "--json" in out


def test_the_documented_commands_exist():
    groups = {name: set(command.commands) for name, command in COMMANDS.items() if isinstance(command, Group)}
    assert {"evaluate", "reproduce", "conform", "benchmark"} <= set(COMMANDS) - set(groups)
    assert {"train", "exploit"} <= set(COMMANDS) - set(groups)
    assert groups["scenarios"] >= {"list", "show", "check"}
    assert groups["defenses"] >= {"list", "show"} and groups["attacks"] >= {"list", "show"}


def test_version_prints_that_of_the_package(cli):
    assert cli("--version") == (0, f"trust-env {trust_env.__version__}\n", "")


def test_the_program_runs_as_a_module():
    done = subprocess.run([*PROGRAM, "--help"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "evaluate" in done.stdout


def test_building_the_parser_loads_nothing_heavy():
    code = "import sys; from trust_env.training.cli import main; main.build_app(); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not {"torch", "numba", "scipy", "pettingzoo", "pyarrow", "matplotlib"} & set(loaded.stdout.split())


@pytest.mark.parametrize(("arguments", "nearest"), [
    (("evaluat", "--attack", "honest"), "unknown command 'evaluat'; did you mean 'evaluate'? known: attacks, bench"),
    (("scenario",), "did you mean 'scenarios'?"),
    (("scenarios", "lst"), "unknown command of scenarios 'lst'; did you mean 'list'? known: check, explain, list"),
    (("nothing-like-it",), "unknown command 'nothing-like-it'; known: attacks"),
    (("evaluate", "--episods", "3"), "--episodes INT"),
    (("train", "--stesp", "3"), "--steps INT"),
    (("exploit", "--knowlege", "own"), "--knowledge {own,"),
])  # fmt: skip
def test_a_mistyped_command_or_option_gets_the_nearest_name(cli, arguments, nearest):
    code, out, err = cli(*arguments)
    assert (code, out) == (2, "") and nearest in err


@pytest.mark.parametrize(
    "arguments",
    [("evaluat",), ("evaluate", "--episodes", "x"), ("evaluate", "--actuation", "no"), (), ("scenarios",)],
)
def test_arguments_that_cannot_be_parsed_have_exit_code_2(cli, arguments):
    code, out, err = cli(*arguments)
    assert (code, out) == (2, "")
    assert "Traceback" not in err
    assert len(err) > 50
