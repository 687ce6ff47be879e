"""How a kernel is declared. A kernel is compiled, and kept on disk, as part of the entries that call it.

Three things keep the first start short. Constant arguments make no versions of their own; nothing is generated
for calls from Python; and a kernel is only translated here, to be optimised once with the whole entry that it
is linked into. An index counts from the start only: -1 is out of range, not the last.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numba
from llvmlite.binding import Linkage
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target
from numba.core.targetconfig import TargetConfig
from numba.core.types import unliteral
from numba.cpython import slicing

from trust_env.compiled.mode import CONFIG, INTERPRETED, OPTIONS, PLAIN


def kernel(function: Callable[..., Any], inline: bool = False) -> Any:
    """A function that kernels and entries call."""
    if INTERPRETED:
        return numba.njit(function)
    if PLAIN:
        return numba.njit(**OPTIONS)(function)
    options: dict[str, Any] = {**OPTIONS, "no_cpython_wrapper": True, "forceinline": inline}
    compiled: Any = numba.njit(**options)(function)
    resolve = compiled.get_call_template

    def get_call_template(args: Any, kws: Any) -> Any:
        with _linking_only():
            return resolve(tuple(map(unliteral, args)), {name: unliteral(value) for name, value in kws.items()})

    compiled.get_call_template = get_call_template
    return compiled


def inlined(function: Callable[..., Any]) -> Any:
    """A small kernel that is copied into those that call it: a call costs as much as its few lines."""
    return kernel(function, inline=True)


def choose(kernels: Sequence[Any], *arguments: str) -> Any:
    """A kernel `(number, *arguments)` that calls the kernel of that number, the last one for any other number.

    Its source is written here, as there is no loop over kernels for the compiler; a chain of kernels, each of
    which calls the next, takes it a fifth longer.
    """
    given, names = ", ".join(arguments), {f"kernel_{number}": one for number, one in enumerate(kernels)}
    *lines, last = [f"return {name}({given})" for name in names]
    choices = [f"    if number == {number}:\n        {line}\n" for number, line in enumerate(lines)]
    exec(f"def choose(number, {given}):\n{''.join(choices)}    {last}\n", names)
    names["choose"].__module__ = __name__
    return kernel(names["choose"])


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


@contextmanager
def compiling_entry() -> Iterator[None]:
    """While an entry is compiled. Loops over a handful of tracks gain nothing from vectors; and each time that
    it looks for a function, Numba compares all its options, where comparing those that were set says the same.
    """
    config: Any = TargetConfig
    context: Any = cpu_target.target_context
    codegen = context.codegen()
    outer = CONFIG.LOOP_VECTORIZE, config.__eq__, config.__hash__, codegen._library_class
    equal, hashed = outer[1], {kind: hash(kind()) for kind in config.__subclasses__()}

    def equals(self: Any, other: Any) -> Any:
        return (type(self) is type(other) and self._values == other._values) or equal(self, other)

    CONFIG.LOOP_VECTORIZE, config.__eq__, config.__hash__ = 0, equals, lambda self: hashed[type(self)]
    codegen._library_class, collecting = _EntryLibrary, gc.isenabled()
    gc.disable()  # a compiler makes few cycles and very many objects
    try:
        yield
    finally:
        if collecting:
            gc.enable()
        CONFIG.LOOP_VECTORIZE, config.__eq__, config.__hash__, codegen._library_class = outer
