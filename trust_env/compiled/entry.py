"""How Python calls kernels: an entry is compiled once, with all kernels that it calls, and kept as machine code,
so that later starts load it without the compiler.
"""

from __future__ import annotations

import ctypes
import functools
import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numba
from llvmlite import binding as llvm
from numba.core import config

from trust_env.compiled import store
from trust_env.compiled.kernels import compiling_entry
from trust_env.compiled.key import key_of_code
from trust_env.compiled.mode import CHECKED, INTERPRETED, OPTIONS, PLAIN, unknown_version

FUNCTIONS: dict[int, Callable[..., Any]] = {}
"""Without the compiler: functions by what stands for their address."""


class Entry:
    """A function of whole numbers (addresses, counts) that calls kernels; compiled, or loaded, at its first call.

    `ready`: whether that call has been; `address`: where its code then lies, as long as it lives. The
    interpreter's lock is released while it runs. slow: say on the screen that it is being compiled, as that
    takes long.
    """

    def __init__(self, function: Callable[..., None], slow: bool = False):
        self._function, self._slow = function, slow
        self._types = (numba.int64,) * function.__code__.co_argcount
        self._call: Callable[..., Any] = function
        self.ready, self.address = INTERPRETED, 0
        if INTERPRETED:
            self.address = 1 + len(FUNCTIONS)
            FUNCTIONS[self.address] = function

    def __call__(self, *args: int) -> None:
        if not self.ready:
            self.prepare()
        self._call(*args)

    def prepare(self) -> None:
        """Compile or load it, unless that is done."""
        if not self.ready:
            self._call, self.ready = self._prepared(), True

    def _prepared(self) -> Callable[..., Any]:
        if CHECKED or PLAIN:  # an index out of range is raised by Numba's own wrapper
            with _announced(self._slow):
                dispatcher: Any = numba.njit(self._types, **OPTIONS)(self._function)
            (result,) = dispatcher.overloads.values()
            self.address = result.library.get_pointer_to_function(result.fndesc.llvm_func_name)
            return dispatcher
        name = f"{self._function.__module__}.{self._function.__name__.strip('_')}"
        key = key_of_code(self._function, *_target())
        kept = store.load(name, key)
        if kept is not None:
            try:
                return self._loaded(kept)
            except (LookupError, ValueError, RuntimeError):
                pass  # made for other libraries than there are
        with _announced(self._slow), compiling_entry():
            code = self._compiled()
        store.save(name, key, code)
        return self._loaded(code)

    def _compiled(self) -> bytes:
        """An object file, after a line that says which function of it to call and what others it calls."""
        options: dict[str, Any] = {**OPTIONS, "no_cpython_wrapper": True}
        dispatcher: Any = numba.njit(**options)(self._function)
        result = dispatcher._compiler.compile(self._types, None)
        module = result.library._final_module
        outer = [f.name for f in module.functions if f.is_declaration and not f.name.startswith("llvm.")]
        cpu, features = _target()
        # Numba's code may lie anywhere in memory, with every address in full; ours lies in one piece.
        machine = llvm.Target.from_default_triple().create_target_machine(
            cpu=cpu, features=features, opt=3, reloc="pic", codemodel="small"
        )
        head = {"symbol": result.fndesc.llvm_func_name, "outer": outer}
        return json.dumps(head).encode() + b"\n" + machine.emit_object(module)

    def _loaded(self, code: bytes) -> Callable[..., Any]:
        """Machine code in memory as a Python function. It returns through two pointers and a status; neither
        says anything, as kernels return nothing and raise nothing.
        """
        head, _, content = code.partition(b"\n")
        found = json.loads(head)
        self._engine = _engine(content, found["outer"])  # the code lives as long as it does
        self.address = self._engine.get_function_address(found["symbol"])
        if not self.address:
            raise LookupError(found["symbol"])
        numbers = [ctypes.c_int64] * len(self._types)
        kind = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *numbers)
        self._returned = (ctypes.c_int64 * 2)()
        result = ctypes.addressof(self._returned)
        return functools.partial(kind(self.address), result, result + 8)


def _engine(code: bytes, outer: list[str]) -> Any:
    """Machine code in memory; raises LookupError where a function that it calls is not there."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    for name in outer:
        if llvm.address_of_symbol(name) is None:
            raise LookupError(name)
    target = llvm.Target.from_default_triple().create_target_machine()
    # The sections of code for the small model must lie close together.
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target, use_lmm=True)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


def _target() -> tuple[str, str]:
    """The processor that is compiled for, and its features: this one, or that of NUMBA_CPU_NAME."""
    name, features = getattr(config, "CPU_NAME", None), getattr(config, "CPU_FEATURES", None)
    if name in (None, "", "host"):
        return llvm.get_host_cpu_name(), features or llvm.get_host_cpu_features().flatten()
    return name, features or ""


@contextmanager
def _announced(slow: bool) -> Iterator[None]:
    """Say on the screen that a long compilation is under way, and when it is done."""
    if not slow:
        yield
        return
    kept = not (CHECKED or PLAIN) and store.folder() is not None
    often = "once per installation" if kept else "at every start, as there is no private folder to keep it in"
    often = "with every index checked" if CHECKED else unknown_version() or often
    long = "a minute" if PLAIN else "20 s"
    print(f"trust-env: compiling the simulator ({often}; about {long}) ...", file=sys.stderr, flush=True)
    start = time.perf_counter()
    yield
    print(f"trust-env: compiled in {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)
