"""Which of our files imports which: every import statement, also inside functions and under TYPE_CHECKING."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple


class Import(NamedTuple):
    """A line of module `source` that imports module `target`."""

    source: str
    target: str
    place: str  # path:line


def code_files(root: Path) -> Iterator[Path]:
    for folder in ("trust_env", "agents", "training"):  # links inside trust_env/ are not followed
        yield from sorted((root / folder).rglob("*.py"))


def module_name(path: Path) -> str:
    """`agents/base.py` is trust_env.agents.base, `agents/__init__.py` trust_env.agents."""
    parts = path.with_suffix("").parts
    parts = parts if parts[0] == "trust_env" else ("trust_env", *parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported_names(node: ast.AST, package: str) -> Iterator[str]:
    """What an import statement names, in full: a.b of `from a import b`, a module or something in one."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        home = ".".join(package.split(".")[: len(package.split(".")) + 1 - node.level]) if node.level else ""
        base = ".".join(filter(None, (home, node.module)))
        yield from (f"{base}.{alias.name}" for alias in node.names)


def nearest_module(name: str, modules: Iterable[str]) -> str | None:
    """The module that a name lies in: itself, or the longest of its beginnings that is one."""
    while name not in modules:
        name, dot, _ = name.rpartition(".")
        if not dot:
            return None
    return name


def imports_of(root: Path) -> list[Import]:
    """Every import of one of our files by another, sorted by place."""
    modules = {module_name(path.relative_to(root)): path for path in code_files(root)}
    found = set[Import]()
    for source, path in modules.items():
        package = source if path.name == "__init__.py" else source.rpartition(".")[0]
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            for name in imported_names(node, package):
                target = nearest_module(name, modules)
                if target not in (None, source):
                    found.add(Import(source, target, f"{path.relative_to(root)}:{node.lineno}"))
    return sorted(found)
