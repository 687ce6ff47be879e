"""Whole numbers in memory that threads share, each given by its address."""

from __future__ import annotations

import ctypes
import platform
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from trust_env.compiled.mode import INTERPRETED

_WORD = ir.IntType(64)


def _pointer(builder: Any, address: Any) -> Any:
    return builder.inttoptr(address, _WORD.as_pointer())


@intrinsic
def _add_in_kernel(typingctx, address, amount):
    def codegen(context, builder, signature, args):
        return builder.atomic_rmw("add", _pointer(builder, args[0]), args[1], "seq_cst")

    return types.int64(types.int64, types.int64), codegen


@intrinsic
def _load_in_kernel(typingctx, address):
    def codegen(context, builder, signature, args):
        return builder.load_atomic(_pointer(builder, args[0]), "seq_cst", 8)

    return types.int64(types.int64), codegen


@intrinsic
def _store_in_kernel(typingctx, address, value):
    def codegen(context, builder, signature, args):
        builder.store_atomic(args[1], _pointer(builder, args[0]), "seq_cst", 8)
        return context.get_dummy_value()

    return types.void(types.int64, types.int64), codegen


@intrinsic
def _pause_in_kernel(typingctx):
    def codegen(context, builder, signature, args):
        if platform.machine().lower() in ("x86_64", "amd64"):
            builder.call(builder.module.declare_intrinsic("llvm.x86.sse2.pause", (), _NOTHING), [])
        return context.get_dummy_value()

    return types.void(), codegen


_NOTHING = ir.FunctionType(ir.VoidType(), [])


def _add_in_python(address: int, amount: int) -> int:
    word = ctypes.c_int64.from_address(int(address))
    word.value += int(amount)
    return word.value - int(amount)


def _load_in_python(address: int) -> int:
    return ctypes.c_int64.from_address(int(address)).value


def _store_in_python(address: int, value: int) -> None:
    ctypes.c_int64.from_address(int(address)).value = int(value)


add: Any = _add_in_python if INTERPRETED else _add_in_kernel
"""Add to the number; returns what it was before."""
load: Any = _load_in_python if INTERPRETED else _load_in_kernel
store: Any = _store_in_python if INTERPRETED else _store_in_kernel
pause: Any = (lambda: None) if INTERPRETED else _pause_in_kernel
"""Tell the processor that the thread waits for another."""
