"""Scenario files in an editor: a YAML language server completes fields, explains them and marks what is wrong."""

from __future__ import annotations

import json

import pytest
from language_server import open_in_editor

from trust_env.scenario.json_schema import scenario_schema

FILE = """\
# yaml-language-server: $schema=scenario.schema.json
base: patrol
description: An example.
sensor:
  sigma: 8.0
  PLACE
fov: {type: sphere}
horizn: 3
agents:
  - role: adversary
    belief: {p_detect: 0.8}
knowledge: PLACE
""".replace("PLACE", "")


def place_of(text: str) -> tuple[int, int]:
    """Where a text ends in the file: line and character, from 0."""
    before = FILE[: FILE.index(text) + len(text)]
    return before.count("\n"), len(before) - before.rfind("\n") - 1


@pytest.fixture(scope="module")
def editor(tmp_path_factory):
    folder = tmp_path_factory.mktemp("editor")
    (folder / "scenario.schema.json").write_text(json.dumps(scenario_schema()))
    (folder / "mine.yaml").write_text(FILE)
    with open_in_editor(folder / "mine.yaml") as found:
        yield found


@pytest.mark.parametrize(
    ("after", "expected", "said"),
    [
        ("sigma: 8.0\n  ", {"p_detect", "noise_cov", "clutter_density"}, ("clutter_density", "per m^2 and scan")),
        ("knowledge: ", {"own", "poses", "picture", "white_box"}, None),
        ("type: ", {"circle", "sector", "polygon"}, None),
        ("belief: {", {"beta_fp", "compromised"}, ("beta_fp", "false positives per m^2")),
    ],
)
def test_the_server_completes_fields_and_values(editor, after, expected, said):
    found = editor.completions(*place_of(after))
    assert expected <= set(found)
    assert said is None or said[1] in found[said[0]]


def test_the_server_explains_a_field(editor):
    assert "standard deviation of x and of y" in editor.hover(*place_of("  sig"))


def test_the_server_marks_what_is_wrong(editor):
    problems = editor.diagnostics()
    lines = {line for line, _ in problems}
    assert {place_of("fov: ")[0], place_of("horizn")[0]} <= lines
    assert place_of("sigma")[0] not in lines and place_of("p_detect: 0.8")[0] not in lines
