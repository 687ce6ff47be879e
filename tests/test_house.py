"""Where code lives and what it may import: one direction, no two files in a circle.

Imports inside functions and under TYPE_CHECKING count like all others.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from pathlib import Path

import pytest
from imports import Import, code_files, imports_of, module_name
from paths import ROOT

# A room (a file or folder of trust_env/) imports from its own row and those above it.
ORDER = """
    errors spec compiled files theory exclusive user_code staging
    scenario
    world
    spaces
    defenses
    metrics
    frame parameters
    batch
    render snapshot
    parallel vector fusion_centre
    __init__
    conformance
    agents
    training
"""
RANKS = {room: rank for rank, row in enumerate(ORDER.strip().splitlines()) for room in row.split()}
PUBLIC_FACE = "trust_env"  # its __init__ names everything, most of it lazily
NOT_MIRRORED = {"clients", "reference"}  # other people's libraries and other people's numbers


def room(module: str) -> str:
    return "__init__" if module == PUBLIC_FACE else module.split(".")[1]


def against_the_order(imports: list[Import]) -> list[str]:
    return [
        f"{place}: {source} imports {target}, but {room(target)} comes after {room(source)}"
        for source, target, place in imports
        if source != PUBLIC_FACE and RANKS[room(target)] > RANKS[room(source)]
    ]


def circles(imports: list[Import]) -> list[str]:
    """Circles of imports; when one is found it is cut where it closes, until there are no more."""
    places = {(source, target): place for source, target, place in imports if source != PUBLIC_FACE}
    graph = defaultdict[str, set[str]](set)
    for source, target in places:
        graph[source].add(target)
    found = []
    while True:
        try:
            TopologicalSorter(graph).prepare()
            return found
        except CycleError as error:
            circle = error.args[1][::-1]  # each imports the next; the last is the first
            steps = list(pairwise(circle))
            found.append("; ".join(f"{places[step]}: {step[0]} imports {step[1]}" for step in steps))
            graph[steps[-1][0]].discard(steps[-1][1])


IMPORTS = imports_of(ROOT)


def test_every_room_has_a_place_in_the_order():
    rooms = {room(module_name(path.relative_to(ROOT))) for path in code_files(ROOT)}
    assert not rooms - set(RANKS), "say in ORDER what these may import"


def test_imports_go_one_way():
    found = against_the_order(IMPORTS)
    assert not found, "\n".join(["imports against the order:", *found])


def test_no_two_files_import_each_other():
    found = circles(IMPORTS)
    assert not found, "\n".join(["files that import each other:", *found])


def test_every_folder_of_code_says_what_is_in_it():
    folders = {path.parent for path in code_files(ROOT)}
    for folder in sorted(folders):
        init, name = folder / "__init__.py", folder.relative_to(ROOT)
        assert init.is_file(), f"{name} has no __init__.py"
        assert ast.get_docstring(ast.parse(init.read_text("utf-8"))), f"{name}/__init__.py has no docstring"


def test_tests_live_in_the_folder_of_what_they_test():
    code = {module_name(path.relative_to(ROOT)) for path in code_files(ROOT)}
    for path in sorted((ROOT / "tests").glob("*/**/test_*.py")):
        name = path.relative_to(ROOT / "tests")
        if name.parts[0] not in NOT_MIRRORED:
            assert ".".join(("trust_env", *name.parts[:-1])) in code, f"tests/{name}: no such folder of code"


def write(root: Path, files: dict[str, str]) -> list[Import]:
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return imports_of(root)


@pytest.mark.parametrize(
    "line",
    [
        "import trust_env.agents.base",
        "from trust_env.agents import base",
        "from trust_env.agents.base import Policy",
        "from ..agents import base",
        "def f():\n    from trust_env.agents.base import Policy",
        "if TYPE_CHECKING:\n    import trust_env.agents.base as b",
    ],
)
def test_an_import_of_any_form_is_seen(tmp_path, line):
    files = {"agents/base.py": "from trust_env.world import fov", "agents/__init__.py": ""}
    imports = write(tmp_path, {**files, "trust_env/world/fov.py": line, "trust_env/world/__init__.py": ""})
    place = f"trust_env/world/fov.py:{line.count(chr(10)) + 1}"
    (found,), (circle,) = against_the_order(imports), circles(imports)
    assert found.startswith(f"{place}: trust_env.world.fov imports trust_env.agents.base")
    assert place in circle and "agents/base.py:1" in circle


def test_the_public_face_is_for_those_outside(tmp_path):
    files = {"trust_env/__init__.py": "import trust_env.batch", "trust_env/batch.py": "import trust_env"}
    imports = write(tmp_path, {**files, "training/a.py": "import trust_env"})
    assert against_the_order(imports) == [
        "trust_env/batch.py:1: trust_env.batch imports trust_env, but __init__ comes after batch"
    ]
