"""What compiled code depends on, as one number: the function, all that it calls, and who compiles it for what."""

from __future__ import annotations

import functools
import hashlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.dispatcher import Dispatcher

from trust_env.compiled.layout import declarations


def key_of_code(function: Callable[..., Any], *target: str) -> str:
    """A digest of a function, of the kernels that it calls and of the constants in them, of the fields, of this
    folder, of the compilers' versions and of the processor that is compiled for.

    TypeError for a kernel that reads a global of a kind whose changes would go unnoticed.
    """
    digest = hashlib.sha256()
    for part in (sys.version, numba.__version__, llvmlite.__version__, declarations(), *target):
        digest.update(f"{part}\n".encode())
    digest.update(_own_sources())
    for text in _described(function):
        digest.update(f"{text}\n".encode())
    return digest.hexdigest()


@functools.cache
def _own_sources() -> bytes:
    files = sorted(Path(__file__).parent.glob("*.py"))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).digest()


def _described(function: Callable[..., Any]) -> Iterator[str]:
    """A text for everything that a function reads, itself or by those that it calls, each once."""
    waiting, seen = [_python(function)], set[Any]()
    while waiting:
        one = waiting.pop()
        if one in seen:
            continue
        seen.add(one)
        yield f"{one.__module__}.{one.__qualname__} {_code(one.__code__)}"
        for name, value in _read_by(one):
            called = _python(value)
            if isinstance(called, FunctionType):
                waiting.append(called)
                value = f"{called.__module__}.{called.__qualname__}"
            yield f"{name} = {_constant(name, value, one)}"


def _python(value: Any) -> Any:
    """The Python function of a kernel; anything else as it is."""
    return value.py_func if isinstance(value, Dispatcher) else value


def _code(code: CodeType) -> str:
    constants = [_code(c) if isinstance(c, CodeType) else _text(c) for c in code.co_consts]
    return f"{code.co_code.hex()} {constants} {code.co_names} {code.co_varnames} {code.co_freevars}"


def _text(constant: Any) -> str:
    """The same in every process, where the order of a set's items is not."""
    return repr(sorted(map(repr, constant)) if isinstance(constant, frozenset) else constant)


def _read_by(function: FunctionType) -> Iterator[tuple[str, Any]]:
    """Names and values of the globals and of the enclosing variables that a function reads."""
    names = function.__code__.co_names
    cells = dict(zip(function.__code__.co_freevars, function.__closure__ or ()))
    yield from ((name, cell.cell_contents) for name, cell in sorted(cells.items()))
    for name in names:
        value = function.__globals__.get(name)
        if isinstance(value, ModuleType) and value.__name__.split(".")[0] not in ("math", "numpy"):
            yield from ((f"{name}.{part}", vars(value)[part]) for part in names if part in vars(value))
        elif name in function.__globals__:
            yield name, value


def _constant(name: str, value: Any, reader: FunctionType) -> str:
    if isinstance(value, (bool, int, float, str, tuple, np.generic, type(None))):
        return repr(value)
    if isinstance(value, (ModuleType, type, BuiltinFunctionType, np.ufunc)):
        return getattr(value, "__name__", repr(value))
    if type(value).__module__ == "numba.core.extending":  # of this folder
        return type(value).__name__
    raise TypeError(f"{reader.__module__}.{reader.__qualname__} reads {name}, of {type(value)}: no constant")
