"""A kernel that is compiled once and kept on disk as machine code, so that later starts load it without the
compiler: they take a third of a second less, and a call from Python a third of the time.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import json
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import llvmlite
import numba
from llvmlite import binding as llvm
from numba.core.caching import FunctionCache

from trust_env.compiled.jit import BOUNDSCHECK, JIT_OFF, OPTIONS, announced, compiling_sooner, source_stamp


@dataclass(frozen=True)
class MachineCode:
    """An object file, the function in it, and the functions of other libraries that it calls."""

    symbol: str
    outer: list[str]
    code: bytes

    def engine(self) -> Any:
        """The code in memory; raises LookupError where a function that it calls is not there."""
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        for name in self.outer:
            if llvm.address_of_symbol(name) is None:
                raise LookupError(name)
        target = llvm.Target.from_default_triple().create_target_machine()
        # The sections of code for the small model must lie close together.
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target, use_lmm=True)
        engine.add_object_file(llvm.ObjectFileRef.from_data(self.code))
        engine.finalize_object()
        return engine


class NativeKernel:
    """A function of whole numbers (addresses, counts), compiled at its first call.

    `ready`: whether that call has been. The interpreter's lock is released while it runs.
    """

    def __init__(self, function: Callable[..., None]):
        self._function, self._arguments = function, function.__code__.co_argcount
        self._call: Callable[..., Any] = function
        self.ready = JIT_OFF

    def __call__(self, *args: int) -> None:
        if not self.ready:
            self.prepare()
        self._call(*args)

    def prepare(self) -> None:
        """Compile or load it, unless that is done."""
        if not self.ready:
            self._call, self.ready = self._prepared(), True

    def _prepared(self) -> Callable[..., Any]:
        if BOUNDSCHECK:  # an index out of range is raised by Numba's own wrapper
            return numba.njit(self._types(), **OPTIONS)(self._function)
        file = self._file()
        with suppress(LookupError, OSError):
            if file is not None:
                return self._loaded(_read(file))
        with announced(), compiling_sooner():
            code = self._compiled()
        with suppress(OSError):  # without a place to keep it, each start compiles
            if file is not None:
                _write(file, code)
        return self._loaded(code)

    def _types(self) -> tuple[Any, ...]:
        return (numba.int64,) * self._arguments

    def _file(self) -> Path | None:
        """Where Numba keeps what it compiles; None where there is no place that can be written."""
        try:
            cache: Any = FunctionCache(self._function)
            cache._impl.locator.ensure_cache_path()
            return Path(cache.cache_path) / f"{self._function.__module__}.{self._function.__name__}.kernel"
        except (RuntimeError, OSError):
            return None

    def _compiled(self) -> MachineCode:
        options: dict[str, Any] = {**OPTIONS, "no_cpython_wrapper": True}
        dispatcher: Any = numba.njit(**options)(self._function)
        result = dispatcher._compiler.compile(self._types(), None)
        module = result.library._final_module
        outer = [f.name for f in module.functions if f.is_declaration and not f.name.startswith("llvm.")]
        target: dict[str, Any] = {}
        result.library.codegen._customize_tm_options(target)
        # Numba's code may lie anywhere in memory, with every address in full; ours lies in one piece.
        target |= {"opt": 3, "reloc": "pic", "codemodel": "small"}
        machine = llvm.Target.from_default_triple().create_target_machine(**target)
        return MachineCode(result.fndesc.llvm_func_name, outer, machine.emit_object(module))

    def _loaded(self, code: MachineCode) -> Callable[..., Any]:
        """Machine code in memory as a Python function. It returns through two pointers and a status; neither
        says anything, as kernels return nothing and raise nothing.
        """
        self._engine = code.engine()  # the code lives as long as it does
        kind = ctypes.CFUNCTYPE(
            ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *[ctypes.c_int64] * self._arguments
        )
        self._returned = (ctypes.c_int64 * 2)()
        result = ctypes.addressof(self._returned)
        function = kind(self._engine.get_function_address(code.symbol))
        return functools.partial(function, result, result + 8)


def _stamp() -> str:
    """What machine code depends on: our sources, the compiler, the processor."""
    host = f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"
    return hashlib.sha256(f"{source_stamp()} {llvmlite.__version__} {host}".encode()).hexdigest()


def _write(file: Path, code: MachineCode) -> None:
    """Put machine code down, whole or not at all."""
    digest = hashlib.sha256(code.code).hexdigest()
    head = {"stamp": _stamp(), "symbol": code.symbol, "outer": code.outer, "digest": digest}
    unfinished = file.with_suffix(f".{os.getpid()}")
    unfinished.write_bytes(json.dumps(head).encode() + b"\n" + code.code)
    os.replace(unfinished, file)


def _read(file: Path) -> MachineCode:
    """Machine code as it was put down; LookupError for a torn file, or one of other sources or processors."""
    head, _, code = file.read_bytes().partition(b"\n")
    try:
        known = json.loads(head)
    except ValueError:
        raise LookupError(f"{file}: not machine code of ours") from None
    if known["stamp"] != _stamp() or known["digest"] != hashlib.sha256(code).hexdigest():
        raise LookupError(f"{file}: out of date")
    return MachineCode(known["symbol"], known["outer"], code)
