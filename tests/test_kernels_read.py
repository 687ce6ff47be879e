"""Kernels read like the method: few lines only fetch fields, and groups are fetched in lines of their own."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from paths import ROOT

from trust_env.compiled.layout import GROUPS
from trust_env.frame import declare_defenses

LEAST_LINES_PER_BINDING = 12
FILES = [*(ROOT / "trust_env").rglob("*.py")]
declare_defenses()


def kernels() -> Iterator[tuple[Path, ast.FunctionDef]]:
    """Every function that is declared as a kernel."""
    for path in FILES:
        if path.is_relative_to(ROOT / "trust_env" / "compiled"):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and declared(node):
                yield path, node


def declared(function: ast.FunctionDef) -> bool:
    return any(isinstance(d, ast.Name) and d.id in ("kernel", "inlined") for d in function.decorator_list)


def statements(function: ast.FunctionDef) -> list[ast.stmt]:
    """The function's body without its docstring."""
    first = function.body[0]
    documented = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return function.body[1:] if documented else function.body


def code_lines(path: Path, function: ast.FunctionDef) -> int:
    """Lines of a kernel with its head, without docstring, comments and blank lines."""
    body, source = statements(function), path.read_text(encoding="utf-8").splitlines()
    if not body:
        return 1
    lines = source[body[0].lineno - 1 : function.end_lineno]
    return 1 + sum(bool(line.strip()) and not line.strip().startswith("#") for line in lines)


def rank(attribute: str) -> int | None:
    """How many axes a field of this name has; None: it is the name of no field."""
    return max((len(g[attribute].axes) for g in GROUPS.values() if attribute in g), default=None)


def fetches(value: ast.expr) -> bool:
    """Whether an expression is a group or a field as it is: `world.agents`, `world.agents.pose[k]`,
    `tracks_of(world, k)`; a number out of an array, `pose[k, 0]`, is not.
    """
    if isinstance(value, ast.Call):
        return ast.unparse(value.func) == "tracks_of"
    indices = 0
    if isinstance(value, ast.Subscript):
        indices = len(value.slice.elts) if isinstance(value.slice, ast.Tuple) else 1
        value = value.value
    if not isinstance(value, ast.Attribute):
        return False
    axes = rank(value.attr)
    return value.attr in GROUPS or (axes is not None and (indices < axes or axes == indices == 0))


def only_binds(statement: ast.stmt) -> bool:
    if not isinstance(statement, ast.Assign):
        return False
    (target,) = statement.targets[:1]
    names = target.elts if isinstance(target, ast.Tuple) else [target]
    values = statement.value.elts if isinstance(statement.value, ast.Tuple) else [statement.value]
    return all(isinstance(name, ast.Name) for name in names) and all(map(fetches, values))


def binding_lines(function: ast.FunctionDef) -> int:
    bound = [node for node in ast.walk(function) if isinstance(node, ast.stmt) and only_binds(node)]
    return sum((node.end_lineno or node.lineno) - node.lineno + 1 for node in bound)


def test_at_most_one_line_of_kernels_in_twelve_only_binds_names_to_fields():
    lines = sum(code_lines(path, function) for path, function in kernels())
    bindings = sum(binding_lines(function) for _, function in kernels())
    assert lines > 800, "the kernels were not found"
    assert bindings * LEAST_LINES_PER_BINDING <= lines, f"{bindings} of {lines} lines only bind names"


def test_groups_of_a_tracker_are_fetched_in_lines_of_their_own():
    found = []
    for path, function in kernels():
        allowed = set[int]()
        for node in ast.walk(function):
            if isinstance(node, ast.Assign):
                values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
                allowed |= {id(value) for value in values}
        found += [
            f"{path.relative_to(ROOT)}:{node.lineno} {function.name}"
            for node in ast.walk(function)
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "tracks_of" and id(node) not in allowed
        ]
    assert found == []


def test_no_kernel_names_a_buffer_an_address_or_an_array_of_one_number():
    words = ("float64(", "from_address", "ctypes", "ROW", "SCRATCH", "PARAMETERS", "layout")
    found = [
        f"{path.relative_to(ROOT)}: {function.name}: {word}"
        for path, function in kernels()
        for word in words
        if word in ast.unparse(function) and "random" not in path.name and function.name != "run_worlds"
    ]
    assert found == []


@pytest.mark.parametrize(
    ("line", "binds"),
    [
        ("tracks = tracks_of(world, tracker)", True),
        ("agents, params = world.agents, world.parameters", True),
        ("pose = world.agents.pose[k]", True),
        ("gate = world.parameters.gate", True),
        ("x = world.agents.pose[k, 0]", False),
        ("c = pairs.column[p]", False),
        ("agents, found = world.agents, 0", False),
        ("tracks.mean[j] = other.mean[j]", False),
    ],
)
def test_what_counts_as_binding(line, binds):
    assert only_binds(ast.parse(line).body[0]) == binds
