"""How kernels are compiled: of fast-math only what keeps `isnan` and the order of sums (fused multiply-add,
reciprocals), without Python errors inside, releasing the interpreter lock.
"""

from __future__ import annotations

import gc
import hashlib
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numba
from llvmlite.binding import Linkage
from numba.core import config
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target
from numba.core.targetconfig import TargetConfig
from numba.core.types import unliteral
from numba.cpython import slicing

OPTIONS: dict[str, Any] = {
    "fastmath": {"contract", "arcp"},
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
    "_nrt": False,
}
_CONFIG: Any = config
JIT_OFF, BOUNDSCHECK = bool(_CONFIG.DISABLE_JIT), bool(_CONFIG.BOUNDSCHECK)


def compiled(function: Any, inlined: bool = False) -> Any:
    """A kernel that other kernels call; it is compiled, and cached, as part of them.

    Three things keep the first start short. Constant arguments make no versions of their own; nothing is
    generated for calls from Python; and a kernel is only translated here, to be optimised once with the whole
    entry that it is linked into. An index counts from the start only: -1 is out of range, not the last.
    """
    options: dict[str, Any] = {**OPTIONS, "no_cpython_wrapper": True, "forceinline": inlined}
    kernel = numba.njit(**options)(function)
    if JIT_OFF:
        return kernel
    resolve = kernel.get_call_template

    def get_call_template(args: Any, kws: Any) -> Any:
        with _linking_only():
            return resolve(
                tuple(map(unliteral, args)), {name: unliteral(value) for name, value in kws.items()}
            )

    kernel.get_call_template = get_call_template
    return kernel


def inlined(function: Any) -> Any:
    """A small kernel that is copied into those that call it: a call costs as much as its few lines."""
    return compiled(function, inlined=True)


class _LinkOnlyLibrary(JITCodeLibrary):
    """Code that is linked into other code, but neither optimised nor turned into machine code by itself, nor
    linked with what it calls before there is an entry to link it all into.
    """

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        self._raise_if_finalized()
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.external:
                function.linkage = "linkonce_odr"
        self._finalize_dynamic_globals()
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """For somebody else's code, which calls a function of Numba's that was first met here."""
        if self._shared_module is None:
            module = self._final_module.clone()
            _link(module, self._linking_libraries)
            self._shared_module = module
        return self._shared_module

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0


class _EntryLibrary(JITCodeLibrary):
    """The code of an entry, linked with all that it calls at once."""

    def _optimize_final_module(self) -> None:
        """In one round; the cheap one that Numba puts before it is for reference counts, and we have none."""
        manager, builder = self._codegen._module_pass_manager()
        manager.run(self._final_module, builder)

    def finalize(self) -> None:
        _link(self._final_module, self._linking_libraries)
        self._linking_libraries = []
        # What only the entry calls may be changed, or go. It must not keep a name, not even an internal one:
        # other code in this process would be given it for its own copy of the same function.
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.linkonce_odr:
                function.linkage = Linkage.private
        super().finalize()


def _link(module: Any, libraries: list[Any]) -> None:
    """Link libraries, and those that they call, into a module."""
    waiting, seen = list(libraries), set[Any]()
    while waiting:
        library = waiting.pop()
        if library in seen:
            continue
        seen.add(library)
        if isinstance(library, _LinkOnlyLibrary):
            waiting.extend(library._linking_libraries)
            module.link_in(library._final_module, preserve=True)
        else:
            module.link_in(library._get_module_for_linking(), preserve=True)


@contextmanager
def _linking_only() -> Iterator[None]:
    context: Any = cpu_target.target_context
    codegen = context.codegen()
    outer = codegen._library_class, codegen.set_env, slicing.fix_index
    codegen._library_class, codegen.set_env = _LinkOnlyLibrary, lambda *_: None
    slicing.fix_index = lambda builder, index, size: index  # instead of adding the size below 0
    try:
        yield
    finally:
        codegen._library_class, codegen.set_env, slicing.fix_index = outer


_PACKAGE = Path(__file__).resolve().parents[1]


def source_stamp() -> str:
    """One hash over all sources that kernels are made of.

    Numba looks at a kernel's own file only when it decides whether its cache is fresh; an edited callee would
    go unnoticed, and so would NUMBA_BOUNDSCHECK.
    """
    digest = hashlib.sha256(f"{numba.__version__} {_CONFIG.BOUNDSCHECK}".encode())
    homes = ("compiled", "world", "spaces", "defenses", "metrics")
    files = [path for home in homes for path in (_PACKAGE / home).rglob("*.py")]
    for path in sorted([*files, _PACKAGE / "frame.py"]):
        digest.update(path.read_bytes())
    return digest.hexdigest()


@contextmanager
def compiling_sooner() -> Iterator[None]:
    """Loops over a handful of tracks gain nothing from vectors; and each time that it looks for a function,
    Numba compares all its options, where comparing those that were set says the same.
    """
    config: Any = TargetConfig
    context: Any = cpu_target.target_context
    codegen = context.codegen()
    outer = _CONFIG.LOOP_VECTORIZE, config.__eq__, config.__hash__, codegen._library_class
    equal, hashed = outer[1], {kind: hash(kind()) for kind in config.__subclasses__()}

    def equals(self: Any, other: Any) -> Any:
        return (type(self) is type(other) and self._values == other._values) or equal(self, other)

    _CONFIG.LOOP_VECTORIZE, config.__eq__, config.__hash__ = 0, equals, lambda self: hashed[type(self)]
    codegen._library_class, collecting = _EntryLibrary, gc.isenabled()
    gc.disable()  # a compiler makes few cycles and very many objects
    try:
        yield
    finally:
        if collecting:
            gc.enable()
        _CONFIG.LOOP_VECTORIZE, config.__eq__, config.__hash__, codegen._library_class = outer


@contextmanager
def announced() -> Iterator[None]:
    """Say on the screen that a compilation, which is long, is under way, and when it is done."""
    print(
        "trust-env: compiling the simulator (once per installation, about 20 s) ...",
        file=sys.stderr,
        flush=True,
    )
    start = time.perf_counter()
    yield
    print(f"trust-env: compiled in {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)


class Entry:
    """A small kernel that Python calls with arrays: compiled at its first call, cached on disk by Numba."""

    def __init__(self, function: Any):
        self.kernel: Any = numba.njit(**OPTIONS)(function)
        self.ready = JIT_OFF

    def __call__(self, *args: Any) -> Any:
        if self.ready:
            return self.kernel(*args)
        self._enable_cache()
        with compiling_sooner():
            result = self.kernel(*args)
        self.ready = True
        return result

    def _enable_cache(self) -> None:
        with suppress(RuntimeError, OSError):  # no writable place for a cache: compile every time
            self.kernel.enable_caching()
            self.kernel._cache._cache_file._source_stamp = source_stamp()
