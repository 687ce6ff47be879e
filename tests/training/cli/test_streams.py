"""Commands whose output is closed, full, cut off or of a narrow encoding: exit codes, and nothing is lost."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest
from paths import ROOT

PROGRAM = f"{sys.executable} -m trust_env.training.cli"
EVALUATE = f"{PROGRAM} evaluate --scenario trio --max-cycles 15 --episodes 4"
SAYS = "trust-env: error: unknown defense 'truts'; did you mean 'trust'?"


def shell(command: str, **environment: str) -> subprocess.CompletedProcess[bytes]:
    """What becomes of a command of the shell; of a pipe, the exit code is that of its first part."""
    code = f"{command}; exit ${{PIPESTATUS[0]}}"
    env = {**os.environ, **environment}
    done = subprocess.run(["bash", "-c", code], cwd=ROOT, env=env, capture_output=True)
    assert b"Traceback" not in done.stderr and b"Exception" not in done.stderr, done.stderr.decode()
    return done


@pytest.mark.parametrize(("command", "code"), [
    ("scenarios show crowd", 0), ("scenarios check patrol nowhere.yaml", 1), ("defenses show truts", 2), ("--help", 0),
])  # fmt: skip
@pytest.mark.parametrize("output", ["| head -1", "| true", ">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-", "2>/dev/full"])
def test_exit_codes_are_those_of_the_command_whoever_reads_it(command, code, output):
    assert shell(f"{PROGRAM} {command} {output}").returncode == code


def test_the_first_lines_are_there_when_the_reader_leaves():
    done = shell(f"{PROGRAM} scenarios show crowd | head -1")
    assert (done.stdout, done.stderr) == (b"name: crowd\n", b"")


def test_messages_do_not_go_to_stdout_when_stderr_is_closed():
    done = shell(f"{EVALUATE} --attack fov_aware --json 2>&-")
    assert json.loads(done.stdout)["episodes"] == 4
    assert shell(f"{PROGRAM} defenses show truts 2>&-").stdout == b""


def test_results_that_stdout_has_no_room_for_are_an_error():
    done = shell(f"{PROGRAM} scenarios list >/dev/full")
    assert (done.returncode, done.stderr) == (2, b"trust-env: error: stdout: No space left on device\n")


def test_results_are_in_the_folder_when_stdout_is_closed(tmp_path):
    assert shell(f"{EVALUATE} --out {tmp_path}/out >&-").returncode == 0
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["courses.parquet", "results.json", "results.parquet"]


@pytest.mark.parametrize("environment", [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "PYTHONUTF8": "0"}])
def test_tables_are_printed_in_ascii_with_the_nearest_signs(environment):
    options = "--defense score,trust --metric damage_per_frame,gospa,track_auroc"
    narrow, wide = (shell(f"{EVALUATE} {options}", **each) for each in (environment, {"PYTHONIOENCODING": "utf-8"}))
    assert (narrow.returncode, wide.returncode) == (0, 0)
    lines, signs = narrow.stdout.decode("ascii").splitlines(), wide.stdout.decode().splitlines()
    for there, here in zip(signs, lines, strict=True):
        if "│" in there:
            assert here == there.replace("│", "|").replace("–", "-")
    assert any("-: undefined" in line for line in lines)
    assert "?" not in narrow.stdout.decode()


def test_names_that_no_encoding_holds_are_printed(tmp_path):
    """A file's name is bytes: these are no UTF-8."""
    done = shell(f"{PROGRAM} scenarios check $'{tmp_path}/b\\xffd.yaml' patrol")
    assert (done.returncode, done.stdout) == (1, b"patrol: ok\n")
    assert b"d.yaml: there is no such file" in done.stderr


def test_a_command_needs_no_home_and_no_terminal():
    kept = {name: os.environ[name] for name in ("NUMBA_CACHE_DIR", "PYTHONPATH") if name in os.environ}
    assignments = " ".join(f"{name}={value}" for name, value in kept.items())
    done = shell(f"env -i {assignments} {EVALUATE} --metric gospa </dev/null")
    assert done.returncode == 0 and "gospa" in done.stdout.decode()


def test_no_number_and_no_name_is_lost_in_40_columns(cli, monkeypatch):
    attacks = "honest,sleeper(start=5, inner=false_positive(n=2))"
    arguments = ("evaluate", "--scenario", "trio", "--max-cycles", "15", "--episodes", "4", "--attack", attacks)
    monkeypatch.setenv("COLUMNS", "40")
    code, narrow, _ = cli(*arguments, "--metric", "all")
    assert code == 0 and max(map(len, narrow.splitlines())) <= 40
    assert "…" not in narrow
    monkeypatch.setenv("COLUMNS", "200")
    _, wide, _ = cli(*arguments, "--metric", "all")

    def numbers(text: str) -> set[str]:
        cells = [cell.strip() for line in text.splitlines() if "│" in line for cell in line.split("│")]
        return {cell for cell in cells if cell[:1].isdigit()}

    assert numbers(wide) == numbers(narrow) and len(numbers(wide)) > 20
