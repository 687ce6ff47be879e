"""The README's code runs, in order, as a reader would type it, and its command lines parse."""

from __future__ import annotations

import functools
import re
import shlex
import sys
from collections.abc import Mapping
from typing import Any

import pytest
import yaml
from paths import ROOT

from trust_env.training.cli import main as cli
from trust_env.training.cli.options import Group

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", TEXT, flags=re.MULTILINE | re.DOTALL)


def blocks(language: str) -> list[str]:
    return [body for name, body in BLOCKS if name == language]


def named_file(body: str) -> str | None:
    """The file that a block says it is, in a comment on its first line."""
    match = re.match(r"# (\w+\.(?:py|yaml))\n", body)
    return match.group(1) if match else None


@pytest.fixture
def reader(tmp_path, monkeypatch):
    """A folder with the README's files in it, from which its modules can be imported."""
    for _, body in BLOCKS:
        if named_file(body):
            (tmp_path / str(named_file(body))).write_text(body)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    sys.modules.pop("my_defense", None)


def test_python_runs_and_prints_what_it_says(reader, capsys):
    namespace: dict = {}
    for body in blocks("python"):
        exec(compile(body, named_file(body) or "README.md", "exec"), namespace)
    printed = capsys.readouterr().out.splitlines()
    shown = float(re.match(r"(\d+\.\d+) injected tracks shown per frame", printed[0]).group(1))
    assert 0.0 <= shown <= 4.0
    assert float(printed[1].split()[0]) >= 0.0
    assert printed[2].startswith("[0 1] ")
    assert printed[3] == "| field | entries | shape | meaning and scaling |"


def test_the_defense_has_ten_lines_of_code(reader):
    lines = [line for line in (reader / "my_defense.py").read_text().splitlines() if line.strip()]
    body = lines[lines.index("class Agreement:") + 2 :]
    assert len(body) <= 10


def test_the_defense_can_be_named_on_the_command_line(reader):
    import trust_env

    env = trust_env.parallel_env("case1", "my_defense.py:Agreement(window=9)")
    env.reset(seed=0)
    assert env.worlds.defense.window == 9


def test_the_scenario_file_is_valid(reader):
    import trust_env

    (name,) = [named_file(body) for body in blocks("yaml")]
    scenario = trust_env.load_scenario(name)
    assert scenario.horizon == yaml.safe_load((reader / str(name)).read_text())["horizon"]
    assert scenario.roles == ("adversary", "benign", "benign", "benign")


def command_lines() -> list[str]:
    """What stands after `trust-env` in shell blocks and in code spans of the text."""
    lines = [line for body in blocks("sh") for line in body.splitlines()]
    spans = re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```$", "", TEXT, flags=re.MULTILINE | re.DOTALL))
    return [text.removeprefix("trust-env ") for text in lines + spans if text.startswith("trust-env ")]


def recorders(commands: Mapping[str, Any], called: list[str], group: str = "") -> dict[str, Any]:
    """Commands with the options of the given ones, which only add their names to `called`."""

    def recorder(name: str, command: Any) -> Any:
        if isinstance(command, Group):
            return Group(command.help, recorders(command.commands, called, f"{name} "))
        return functools.wraps(command)(lambda *_, **__: called.append(group + name))

    return {name: recorder(name, command) for name, command in commands.items()}


@pytest.mark.parametrize("line", dict.fromkeys(command_lines()))
def test_every_command_line_parses(monkeypatch, line):
    called: list[str] = []
    monkeypatch.setattr(cli, "COMMANDS", recorders(cli.COMMANDS, called))
    assert cli.main(shlex.split(line, comments=True)) == 0
    (name,) = called
    assert line.startswith(name)


def test_the_readme_shows_every_kind_of_command():
    shown = {line.split()[0] for line in command_lines()}
    assert shown >= {"evaluate", "reproduce", "conform", "scenarios", "benchmark", "train", "exploit"}


def test_make_targets_exist():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"^make (\w+)", "\n".join(blocks("sh")), flags=re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), target
