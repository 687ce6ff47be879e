"""Hooks of MkDocs: pages that are made from the code, tables that commands wrote, and the check that nothing public
lacks a docstring.
"""

from __future__ import annotations

import importlib
import inspect
import re
import sys
from pathlib import Path
from types import FunctionType
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]

import generated  # noqa: E402 (found by the line above)

_API = re.compile(r"^::: ([\w.]+)$", re.MULTILINE)
_TABLES = "<!-- the tables in docs/tables -->"


def on_files(files: Files, config: Any) -> Files:
    """The generated pages beside those that are written."""
    for path, text in generated.all_pages().items():
        files.append(File.generated(config, path, content=text))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """A page with the tables in place; PluginError where what it documents has no docstring."""
    missing = [lacking for name in _API.findall(markdown) for lacking in undocumented(name)]
    if missing:
        raise PluginError(f"{page.file.src_uri}: no docstring: {', '.join(missing)}")
    return markdown.replace(_TABLES, generated.results_tables() or "*No tables have been made yet.*")


def undocumented(name: str) -> list[str]:
    """What of an object, or of a module's public names, and of their public methods, has no docstring of its own."""
    module, _, attribute = name.rpartition(".")
    try:
        found = {name: importlib.import_module(name)}
    except ModuleNotFoundError:
        found = {name: getattr(importlib.import_module(module), attribute)}
    thing = found[name]
    if inspect.ismodule(thing):
        found |= {f"{name}.{inner}": getattr(thing, inner) for inner in getattr(thing, "__all__", ())}
    for full, one in list(found.items()):
        if inspect.isclass(one):
            found |= {f"{full}.{key}": getattr(one, key) for key in vars(one) if _is_documented(one, key)}
    return [full for full, one in found.items() if not inspect.getdoc(one)]


def _is_documented(owner: type, key: str) -> bool:
    """Whether what a class defines under a name has to have a docstring."""
    value = inspect.getattr_static(owner, key)
    return not key.startswith("_") and isinstance(value, (FunctionType, property, classmethod, staticmethod))
