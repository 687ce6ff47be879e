"""Kernels that are compiled apart from the code that calls them, and only when somebody needs them.

entry = kernels_apart("trust", (reset, judge))    # two kernels (world)
call_apart(entry.address, 1, world)               # in another kernel: the second of them
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from trust_env.compiled import structs
from trust_env.compiled.entry import FUNCTIONS, Entry
from trust_env.compiled.kernels import choose
from trust_env.compiled.layout import BUFFERS
from trust_env.compiled.mode import INTERPRETED
from trust_env.compiled.structs import world_at, world_type


def kernels_apart(name: str, kernels: Sequence[Any]) -> Entry:
    """An entry `(number, row, parameters, scratch, actions, layout)` that runs the kernel of that number in a
    world; its code is kept under the name.
    """
    run = choose(kernels, "world")

    def run_apart(number, row, parameters, scratch, actions, layout):
        run(number, world_at(row, parameters, scratch, actions, layout))

    run_apart.__name__ = name
    return Entry(run_apart)


@intrinsic
def _call(typingctx, address, number, world):
    arguments = (types.int64,) * (2 + len(BUFFERS))

    def codegen(context, builder, signature, args):
        words = [args[1], *(builder.extract_value(args[2], i) for i in range(1 + len(BUFFERS)))]
        convention = context.call_conv
        kind = convention.get_function_type(types.none, arguments)
        function = builder.inttoptr(args[0], kind.as_pointer())
        status, _ = convention.call_function(builder, function, types.none, arguments, words)
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return context.get_dummy_value()

    return types.none(types.int64, types.int64, world_type), codegen


def _call_python(address: int, number: int, world: structs.World) -> None:
    FUNCTIONS[int(address)](number, *world)


call_apart: Any = _call_python if INTERPRETED else _call
"""Call, in a kernel, a kernel of `kernels_apart`: `(address, number, world)`."""
