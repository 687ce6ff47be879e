"""`demo`: one table, and commands to try next that exist."""

from __future__ import annotations

import re
import shlex

import pytest

from trust_env.training.cli.demo import ATTACKS, DEFENSES, NEXT
from trust_env.training.cli.main import check_command


def test_the_demo_prints_one_table_of_80_columns_and_what_to_try_next(cli, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, err = cli("demo", "--out", tmp_path / "demo", "--episodes", "2")
    assert code == 0, err
    lines = out.splitlines()
    assert max(len(line) for line in lines if "trust-env" not in line and str(tmp_path) not in line) <= 80
    assert len(re.findall(r"\bdamage\b.*\binjected\b", out)) == 1
    for name in DEFENSES:
        assert sum(bool(re.search(rf"\b{name}\b", line)) for line in lines) >= len(ATTACKS)
    assert all(f"    {command}" in lines for _, command in NEXT) and len(NEXT) == 3
    assert (tmp_path / "demo" / "report.html").stat().st_size < 8_000_000
    again = cli("demo", "--out", tmp_path / "demo", "--episodes", "2")
    assert (again[0], again[1]) == (0, out)


@pytest.mark.parametrize("command", [part for _, text in NEXT for part in text.split("; ")])
def test_what_to_try_next_exists(command):
    program, *words = shlex.split(command)
    assert program == "trust-env"
    check_command(words)


def test_the_most_that_it_says_to_evaluate_runs(cli):
    words = shlex.split(NEXT[-1][1])[1:]
    assert cli(*words, "--episodes", "1", "--max-cycles", "10")[0] == 0
