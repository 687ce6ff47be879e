"""The code in README and in the pages runs, in order, as a reader would type it; command lines parse; links lead
somewhere.
"""

from __future__ import annotations

import functools
import re
import shlex
import sys
from collections.abc import Mapping
from typing import Any

import pytest
import yaml
from documents import DOCUMENTS, README, blocks, command_lines, name_of, named_file
from paths import ROOT

import trust_env
from trust_env.training.cli import main as cli
from trust_env.training.cli.options import Group

WITH_CODE = [document for document in DOCUMENTS if blocks(document, "python")]
WITH_COMMANDS = [document for document in DOCUMENTS if command_lines(document)]
WITH_SCENARIOS = [document for document in DOCUMENTS if any(map(named_file, blocks(document, "yaml")))]
NOT_A_COMMAND = {"--help"}


@pytest.fixture
def reader(tmp_path, monkeypatch):
    """An empty folder, from which modules can be imported."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", "")).startswith(str(tmp_path)):
            del sys.modules[name]


def save(folder, document) -> None:
    """The files that a document's blocks say they are."""
    for body in blocks(document, "python", "yaml"):
        if named_file(body):
            (folder / str(named_file(body))).write_text(body)


def run(document) -> None:
    """All of a document's Python, in one namespace."""
    namespace: dict = {}
    for body in blocks(document, "python"):
        exec(compile(body, named_file(body) or name_of(document), "exec"), namespace)


@pytest.mark.parametrize("document", WITH_CODE, ids=name_of)
def test_python_runs(reader, capsys, document):
    save(reader, document)
    run(document)
    assert capsys.readouterr().out.strip() or name_of(document).endswith("built.md")


@pytest.mark.parametrize("document", WITH_SCENARIOS, ids=name_of)
def test_scenario_files_are_valid(reader, document):
    save(reader, document)
    for body in blocks(document, "yaml"):
        if named_file(body):
            scenario = trust_env.load_scenario(named_file(body))
            assert scenario.description == yaml.safe_load(body)["description"]


def recorders(commands: Mapping[str, Any], called: list[str], group: str = "") -> dict[str, Any]:
    """Commands with the options of the given ones, which only add their names to `called`."""

    def recorder(name: str, command: Any) -> Any:
        if isinstance(command, Group):
            return Group(command.help, recorders(command.commands, called, f"{name} "))
        return functools.wraps(command)(lambda *_, **__: called.append(group + name))

    return {name: recorder(name, command) for name, command in commands.items()}


def shown_commands(document) -> list[str]:
    """Complete command lines: a span such as `trust-env threats` only names a command."""
    lines = [line for line in command_lines(document) if not {"|", *NOT_A_COMMAND} & set(re.split(r"(\|)|\s", line))]
    return [line for line in lines if not isinstance(cli.COMMANDS.get(line.strip()), Group)]


@pytest.mark.parametrize("document", WITH_COMMANDS, ids=name_of)
def test_every_command_line_parses(monkeypatch, document):
    for line in shown_commands(document):
        called: list[str] = []
        with monkeypatch.context() as patched:
            patched.setattr(cli, "COMMANDS", recorders(cli.COMMANDS, called))
            words = [re.sub(r"^(FILE|FIELD|NAME)$", "name", word) for word in shlex.split(line, comments=True)]
            assert cli.main(words) == 0, line
        (name,) = called
        assert line.startswith(name)


def test_the_documents_show_every_command():
    shown = {line.split()[0] for document in WITH_COMMANDS for line in command_lines(document)}
    assert shown >= set(cli.COMMANDS)


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_links_lead_to_files(document):
    generated = {"attacks", "commands", "defenses", "metrics", "ranking", "scenarios", "spaces", "threats", "training"}
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", document.read_text("utf-8")):
        if "://" in target:
            continue
        path = (document.parent / target).resolve()
        made = path.parent.name == "reference" and path.stem in generated
        made |= path.parent.name == "tutorials" and (ROOT / "docs" / "tutorials" / f"{path.stem}.ipynb").is_file()
        assert path.is_file() or made, f"{name_of(document)}: {target}"


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_make_targets_exist(document):
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"^make (\w[\w-]*)", "\n".join(blocks(document, "sh")), flags=re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), target


# --- README -------------------------------------------------------------------------------------------------


def test_the_readme_is_short_and_has_a_picture_two_commands_and_thirty_lines_of_python():
    text = README.read_text("utf-8")
    assert len(text.splitlines()) <= 120
    assert re.search(r"^!\[[^\]]+\]\((docs/pages/picture\.png)\)$", text, flags=re.MULTILINE)
    assert len([line for line in blocks(README, "sh")[0].splitlines() if line]) == 2
    lines = [line for body in blocks(README, "python") for line in body.splitlines() if line.strip()]
    assert 25 <= len(lines) <= 32


def test_the_readmes_python_says_how_many_injected_tracks_are_shown(reader, capsys):
    save(reader, README)
    run(README)
    shown = re.fullmatch(r"(\d+\.\d+) injected tracks shown per frame", capsys.readouterr().out.strip())
    assert shown and 0.0 <= float(shown.group(1)) <= 4.0


def test_the_defense_has_ten_lines_of_code():
    (body,) = [body for body in blocks(README, "python") if named_file(body)]
    lines = [line for line in body.splitlines() if line.strip()]
    assert len(lines[lines.index("class Agreement:") + 2 :]) <= 10


def test_the_defense_can_be_named_on_the_command_line(reader):
    save(reader, README)
    env = trust_env.parallel_env("case1", "my_defense.py:Agreement(window=9)")
    env.reset(seed=0)
    assert env.worlds.defense.window == 9
