"""The examples of other libraries: all are short, all are tested somewhere. They run in tests/clients."""

from __future__ import annotations

import pytest
from paths import ROOT

EXAMPLES = sorted(path for path in (ROOT / "training" / "examples").glob("*.py") if path.stem != "__init__")


def test_there_are_some():
    assert len(EXAMPLES) >= 5


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_has_sixty_lines_at_most(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 60


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_tested(path):
    tests = [*(ROOT / "tests" / "clients").iterdir()]
    assert any(path.stem in test.read_text(encoding="utf-8") for test in tests if test.is_file())
