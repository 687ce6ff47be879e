"""Objects from Python files that the user names; no other code runs such files."""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from trust_env.errors import unknown_name
from trust_env.files import expanded


def load_from_file(file: str, name: str) -> Any:
    """The object `name` of a Python file, which runs once for as long as it does not change."""
    path = expanded(file).resolve()
    if not path.is_file():
        raise ValueError(f"{file}:{name}: there is no file {path}")
    module = _module(path, path.stat().st_mtime_ns)
    if not hasattr(module, name):
        raise unknown_name(f"name in {file}:", name, (n for n in vars(module) if not n.startswith("_")))
    return getattr(module, name)


@functools.cache
def _module(path: Path, mtime_ns: int) -> ModuleType:
    name = f"{path.stem}_{hashlib.sha256(f'{path}:{mtime_ns}'.encode()).hexdigest()[:12]}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ValueError(f"{path}: expected a Python file, whose name ends in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up by name
    try:
        spec.loader.exec_module(module)
    except Exception as fault:
        del sys.modules[name]
        raise ValueError(f"{path}: could not be run: {type(fault).__name__}: {fault}") from fault
    return module
