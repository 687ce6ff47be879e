"""No test depends on how busy the machine is: what a clock says decides nothing but when a test gives up."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from paths import ROOT

CLOCKS = {"perf_counter", "monotonic", "process_time", "thread_time", "perf_counter_ns", "monotonic_ns", "time_ns"}


def reads_clock(node: ast.AST, timed: set[str]) -> bool:
    """Whether an expression calls a clock, or uses a name whose value comes from one."""
    names = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
    attributes = [each for each in ast.walk(node) if isinstance(each, ast.Attribute)]
    now = any(
        isinstance(each.value, ast.Name) and (each.value.id, each.attr) == ("time", "time") for each in attributes
    )
    return now or bool(names & (timed | CLOCKS) or {each.attr for each in attributes} & CLOCKS)


def asserted_clocks(text: str) -> list[int]:
    """The lines of asserts that compare what a clock said."""
    found = []
    for function in (each for each in ast.walk(ast.parse(text)) if isinstance(each, ast.FunctionDef)):
        timed: set[str] = set()
        for node in sorted(ast.walk(function), key=lambda each: getattr(each, "lineno", 0)):
            if isinstance(node, ast.Assign) and reads_clock(node.value, timed):
                timed |= {each.id for target in node.targets for each in ast.walk(target) if isinstance(each, ast.Name)}
            elif isinstance(node, ast.Assert) and reads_clock(node.test, timed):
                found.append(node.lineno)
    return sorted(set(found))


def test_no_test_asserts_how_long_something_takes():
    for path in sorted((ROOT / "tests").rglob("*.py")):
        if path != Path(__file__):
            lines = asserted_clocks(path.read_text("utf-8"))
            assert not lines, f"{path.relative_to(ROOT)}: a clock is asserted in lines {lines}"


@pytest.mark.parametrize(("text", "lines"), [
    ("def f():\n    a = time.perf_counter()\n    g()\n    assert time.perf_counter() - a < 1", [4]),
    ("def f():\n    a = monotonic()\n    b = monotonic() - a\n    c = b / 2\n    assert c < 1", [5]),
    ("def f():\n    assert time.time() < 3", [2]),
    ("def f():\n    end = time.monotonic() + 60\n    while time.monotonic() < end:\n        g()\n    assert h()", []),
])  # fmt: skip
def test_an_asserted_clock_is_seen_and_a_deadline_is_none(text, lines):
    assert asserted_clocks(text) == lines
