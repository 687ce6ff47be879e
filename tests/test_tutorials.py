"""The tutorials run as they are, and the pages that are made from the code hold what is registered."""

from __future__ import annotations

import sys

import pytest
from paths import ROOT

import trust_env
from trust_env.agents import POLICIES
from trust_env.defenses import DEFENSES
from trust_env.metrics import METRICS
from trust_env.scenario.json_schema import field_infos
from trust_env.training.cli.main import COMMANDS

DOCS = ROOT / "docs"
TUTORIALS = sorted((DOCS / "tutorials").glob("*.ipynb"))


@pytest.fixture(autouse=True)
def docs_on_the_path(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    yield
    for name in ("generated", "run_tutorials", "hooks", "picture"):
        sys.modules.pop(name, None)


@pytest.mark.slow
@pytest.mark.extra("docs")
@pytest.mark.extra("train")
@pytest.mark.parametrize("file", TUTORIALS, ids=lambda file: file.stem)
def test_a_tutorial_runs_and_prints_what_its_page_shows(tmp_path, monkeypatch, file):
    import nbformat
    import run_tutorials

    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    found, saved = run_tutorials.run(file, str(tmp_path)), nbformat.read(file, as_version=4)
    for cell, before in zip(found.cells, saved.cells, strict=True):
        printed, shown = ([o["text"] for o in c.get("outputs", ()) if o["name"] == "stdout"] for c in (cell, before))
        assert len("".join(printed).splitlines()) == len("".join(shown).splitlines()), cell.source


def test_there_are_three_tutorials():
    assert [file.stem for file in TUTORIALS] == ["own-defense", "own-scenario", "train-an-attacker"]


def test_pages_made_from_the_code_hold_what_is_registered():
    import generated

    pages = {path: make() for path, make in generated.PAGES.items()}
    for path, names in (
        ("attacks", POLICIES),
        ("defenses", DEFENSES),
        ("metrics", METRICS),
        ("scenarios", (*trust_env.scenarios(), *(name for name in field_infos() if "." in name))),
        ("commands", COMMANDS),
    ):
        text = pages[f"reference/{path}.md"]
        assert [name for name in names if f"`{name}`" not in text and f"## {name}\n" not in text] == []
    assert "usage: trust-env evaluate" in pages["reference/commands.md"]
    assert "| `gate` |" not in pages["reference/scenarios.md"]  # fields stand there by their whole names


def test_text_from_the_code_means_nothing_to_markdown_outside_code_spans():
    import generated

    assert generated.escape("a|b <c> `d|e` p_detect") == r"a\|b \<c\> `d|e` p\_detect"


@pytest.mark.extra("docs")
def test_what_lacks_a_docstring_is_named():
    import hooks

    class Bare:
        def method(self): ...

    sys.modules["bare_module"] = type(sys)("bare_module")
    sys.modules["bare_module"].Bare = Bare  # type: ignore[attr-defined]
    try:
        assert hooks.undocumented("bare_module.Bare") == ["bare_module.Bare", "bare_module.Bare.method"]
    finally:
        del sys.modules["bare_module"]
    assert hooks.undocumented("trust_env.agents.Policy") == []


@pytest.mark.extra("render")
def test_the_picture_is_made_by_its_command(tmp_path):
    import picture

    picture.draw(tmp_path / "picture.png")
    made, kept = (tmp_path / "picture.png").read_bytes(), picture.FILE.read_bytes()
    assert made[16:24] == kept[16:24]  # width and height
    assert len(kept) < 200_000
