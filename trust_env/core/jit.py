"""How kernels are compiled: of fast-math only what keeps `isnan` and the order of sums (fused multiply-add,
reciprocals), without Python errors inside, releasing the interpreter lock.
"""

from __future__ import annotations

import gc
import hashlib
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target
from numba.core.types import unliteral
from numba.cpython import slicing

_OPTIONS: dict[str, Any] = {
    "fastmath": {"contract", "arcp"},
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
    "_nrt": False,
}
_CONFIG: Any = config
_JIT_OFF = bool(_CONFIG.DISABLE_JIT)


def compiled(function: Any, inlined: bool = False) -> Any:
    """A kernel that other kernels call; it is compiled, and cached, as part of them.

    Three things keep the first start short. Constant arguments make no versions of their own; nothing is
    generated for calls from Python; and a kernel is only translated here, to be optimised once with the whole
    entry that it is linked into. An index counts from the start only: -1 is out of range, not the last.
    """
    options: dict[str, Any] = {**_OPTIONS, "no_cpython_wrapper": True, "forceinline": inlined}
    kernel = numba.njit(**options)(function)
    if _JIT_OFF:
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
    """Code that is linked into other code, but neither optimised nor turned into machine code by itself."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0


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
    homes = [*(_PACKAGE / "core").glob("*.py"), *(_PACKAGE / "defenses").glob("*.py")]
    for path in sorted([*homes, *(_PACKAGE / name for name in ("engine.py", "observation.py", "reward.py"))]):
        digest.update(path.read_bytes())
    return digest.hexdigest()


@contextmanager
def _short_loops() -> Iterator[None]:
    """Loops over a handful of tracks gain nothing from vectors: without, they are compiled sooner."""
    outer, _CONFIG.LOOP_VECTORIZE = _CONFIG.LOOP_VECTORIZE, 0
    try:
        yield
    finally:
        _CONFIG.LOOP_VECTORIZE = outer


class Entry:
    """A kernel that Python calls: compiled at its first call, cached on disk, and says so on the screen while
    it compiles.
    """

    def __init__(self, function: Any, announced: bool = False):
        self.kernel: Any = numba.njit(**_OPTIONS)(function)
        self.ready = _JIT_OFF
        self.announced = announced

    def __call__(self, *args: Any) -> Any:
        if not self.ready:
            return self._first_call(*args)
        return self.kernel(*args)

    def _first_call(self, *args: Any) -> Any:
        fresh = self._enable_cache() and self.announced
        if fresh:
            print(
                "trust-env: compiling the simulator (once per installation, about 20 s) ...",
                file=sys.stderr,
                flush=True,
            )
        start, collecting = time.perf_counter(), gc.isenabled()
        gc.disable()  # a compiler makes few cycles and very many objects
        try:
            with _short_loops():
                result = self.kernel(*args)
        finally:
            if collecting:
                gc.enable()
        if fresh:
            print(f"trust-env: compiled in {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)
        self.ready = True
        return result

    def _enable_cache(self) -> bool:
        """Attach the disk cache; True when it holds nothing to load (so that the call that follows will
        compile).
        """
        try:
            self.kernel.enable_caching()
            file = self.kernel._cache._cache_file
            file._source_stamp = source_stamp()
            return not file._load_index()
        except (RuntimeError, OSError, AttributeError):  # no writable place for a cache: compile every time
            return True
