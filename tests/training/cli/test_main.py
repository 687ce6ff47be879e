"""The program `trust-env`: help, what starting it loads, exit codes."""

import subprocess
import sys

import pytest
from paths import ROOT

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


def test_the_program_runs_as_a_module():
    done = subprocess.run([*PROGRAM, "--help"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "evaluate" in done.stdout


def test_building_the_parser_loads_nothing_heavy():
    code = "import sys; from trust_env.training.cli import main; main.build_app(); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not {"torch", "numba", "scipy", "pettingzoo", "pyarrow", "matplotlib"} & set(loaded.stdout.split())


@pytest.mark.parametrize(
    "arguments",
    [("evaluat",), ("evaluate", "--episodes", "x"), ("evaluate", "--actuation", "no"), (), ("scenarios",)],
)
def test_arguments_that_cannot_be_parsed_have_exit_code_2(cli, arguments):
    code, out, err = cli(*arguments)
    assert (code, out) == (2, "")
    assert "Traceback" not in err
    assert len(err) > 50


def test_a_closed_pipe_is_no_error():
    command = f"{sys.executable} -m trust_env.training.cli scenarios show crowd | head -1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "name: crowd\n", "")
