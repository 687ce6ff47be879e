"""Published tables: every command is one that plays, and rows are what its JSON says."""

from __future__ import annotations

import shlex

import pytest

from trust_env.agents import build_policy, policies
from trust_env.defenses import DEFENSES as BUILT_IN
from trust_env.defenses import build_defense
from trust_env.scenario import load_scenario
from trust_env.spec import split_specs
from trust_env.training.cli.main import check_command
from trust_env.training.published import rows
from trust_env.training.published.tables import ATTACKS, DEFENSES, RECORDING, TABLES, Table
from trust_env.training.published.write import page, run, write

_ELSEWHERE = {"learned", "planner"}  # which are trained, and take minutes a cell


def _option(table: Table, name: str) -> str:
    return table.command[table.command.index(name) + 1]


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.name)
def test_every_command_names_what_there_is(table: Table):
    check_command(table.command)
    if "--scenario" in table.command and RECORDING not in table.command:
        load_scenario(_option(table, "--scenario"))
    for attack in split_specs(_option(table, "--attack")):
        build_policy(attack)
    for defense in split_specs(_option(table, "--defense")):
        build_defense(defense)
    assert _option(table, "--episodes") == "100"


def test_the_great_table_leaves_nothing_out():
    named = {attack.partition("(")[0] for attack in ATTACKS}
    assert set(policies()) - named <= _ELSEWHERE
    assert set(BUILT_IN) == {defense.partition("(")[0] for defense in DEFENSES}


SMALL = ("evaluate", "--scenario", "trio(horizon=12)", "--attack", "honest,false_positive", "--defense", "score,trust",
         "--episodes", "3")  # fmt: skip


@pytest.mark.parametrize(
    ("command", "lines", "row"),
    [
        (SMALL, rows.damage, "| `false_positive` |"),
        (SMALL, rows.worst, "| mean of the rows |"),
        ((*SMALL, "--against", "trust"), rows.against("score"), " to "),
        (SMALL, rows.calibration, "| `trust(preset=paper)` | tracks |"),
        (("curve", *SMALL[1:], "--over", "slots", "--values", "1,2"), rows.curve, "| `honest` | `score` |"),
    ],
)
def test_rows_are_made_of_what_a_command_prints(command, lines, row):
    table = Table("small", "Small", "What it is.", command, lines)
    found = page(table, run(command))
    assert found[0] == "## Small" and any(row in line for line in found)
    assert len({line.count("|") for line in found if line.startswith("|")}) == 1
    assert found[-2] == f"trust-env {shlex.join(command)}"


def test_the_mean_of_a_cell_is_in_its_place():
    found = run(SMALL)
    cell = next(c for c in found["cells"] if (c["attack"], c["defense"]) == ("false_positive", "score"))
    line = next(line for line in rows.damage(found) if line.startswith("| `false_positive` |"))
    assert float(line.split("|")[2]) == pytest.approx(cell["metrics"]["damage_per_frame"]["mean"], rel=6e-3, abs=6e-4)


def test_a_command_that_fails_writes_no_table():
    with pytest.raises(RuntimeError, match="trust-env evaluate --attack nothing failed"):
        run(("evaluate", "--attack", "nothing"))


def test_tables_of_a_recording_are_left_out_without_one(tmp_path, capsys):
    write(tmp_path, only="skies")
    assert "left out, as it needs --data" in capsys.readouterr().out and not list(tmp_path.iterdir())


def test_an_unknown_table_is_refused(tmp_path):
    with pytest.raises(ValueError, match="did you mean 'patrol'"):
        write(tmp_path, only="patrl")
