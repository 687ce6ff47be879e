"""How kernels read memory: by groups of named fields, cut out of rows of bytes where they are asked for.

    tracks = tracks_of(world, tracker)
    tracks.mean[j, 0] += 1.0              # a field with axes is an array
    world.clock.frame += 1                # one without is a number

A `world` is five addresses. `world.agents` is a group of its fields; `world.tracks` are the central tracker's,
`tracks_of(world, tracker)` those of any. A group is five words in registers: passing it on costs nothing, a
field that is not asked for costs nothing, and what is read is what lies there now. Which fields there are, and
where each lies, is said in `layout`.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    lower_setattr_generic,
    models,
    register_model,
)
from numba.np.arrayobj import make_array, populate_array
from numba.np.numpy_support import as_dtype

from trust_env.compiled.layout import (
    BUFFERS,
    GROUPS,
    LETTERS,
    MOST_SLOTS,
    PARAMETERS,
    ROW,
    TRACKER_BYTES,
    Field,
)
from trust_env.compiled.mode import INTERPRETED

CENTRAL = -1  # the number of the central tracker; those of the agents' own are the agents'
_WORD = ir.IntType(64)
_ADDRESSES = (*BUFFERS, "layout")


class _WorldType(types.Type):
    """Five addresses: the buffers, and the layout's table."""


class _GroupType(types.Type):
    """A group of a world's fields: the world's addresses, or of a tracker's group those moved to the tracker."""

    def __init__(self, group: str):
        super().__init__(f"trust_env.{group}")
        self.group = group


world_type = _WorldType("trust_env.World")


@register_model(_WorldType)
@register_model(_GroupType)
class _AddressesModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any):
        super().__init__(manager, kind, [(name, types.int64) for name in _ADDRESSES])


def _type_of(field: Field) -> Any:
    item = numba.from_dtype(field.dtype)
    return item if field.is_number else types.Array(item, len(field.axes), "C")


@infer_getattr
class _WorldAttribute(AttributeTemplate):
    key = _WorldType

    def generic_resolve(self, typ: Any, attr: str) -> Any:
        return _GroupType(attr) if attr in GROUPS else None


@infer_getattr
class _GroupAttribute(AttributeTemplate):
    key = _GroupType

    def generic_resolve(self, typ: Any, attr: str) -> Any:
        field = GROUPS[typ.group].get(attr)
        return None if field is None else _type_of(field)


@lower_getattr_generic(_WorldType)
def _get_group(context: Any, builder: Any, typ: Any, value: Any, attr: str) -> Any:
    return value


@lower_getattr_generic(_GroupType)
def _get_field(context: Any, builder: Any, typ: Any, value: Any, attr: str) -> Any:
    field, address, shape = _located(builder, typ, value, attr)
    result = _type_of(field)
    pointer = builder.inttoptr(address, context.get_data_type(numba.from_dtype(field.dtype)).as_pointer())
    if field.is_number:
        number = context.unpack_value(builder, result, pointer)
        if field.buffer == PARAMETERS:
            _never_changes(builder, number)
        return number
    return _array(context, builder, result, pointer, shape)


@lower_setattr_generic(_GroupType)
def _set_field(context: Any, builder: Any, signature: Any, args: Any, attr: str) -> None:
    typ, given = signature.args
    field, address, _ = _located(builder, typ, args[0], attr)
    result = _type_of(field)
    pointer = builder.inttoptr(address, context.get_data_type(result).as_pointer())
    context.pack_value(builder, result, context.cast(builder, args[1], given, result), pointer)


def _packed(context: Any, builder: Any, typ: Any, words: list[Any]) -> Any:
    struct = ir.Constant(context.get_value_type(typ), ir.Undefined)
    for i, word in enumerate(words):
        struct = builder.insert_value(struct, word, i)
    return struct


def _located(builder: Any, typ: Any, value: Any, attr: str) -> tuple[Field, Any, list[Any]]:
    """A field, its address, and its lengths."""
    field = GROUPS[typ.group][attr]
    base, layout = (builder.extract_value(value, i) for i in (field.buffer, len(BUFFERS)))
    shape = [
        _WORD(int(axis)) if axis.isdigit() else _table_entry(builder, layout, LETTERS[axis]) for axis in field.axes
    ]
    return field, builder.add(base, _table_entry(builder, layout, field.slot)), shape


def _table_entry(builder: Any, layout: Any, slot: int) -> Any:
    table = builder.inttoptr(layout, _WORD.as_pointer())
    return _never_changes(builder, builder.load(builder.gep(table, [_WORD(slot)])))


def _never_changes(builder: Any, loaded: Any) -> Any:
    """Loads of the layout and of parameters may be merged, and moved out of loops."""
    if isinstance(loaded, ir.LoadInstr):
        loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
    return loaded


def _array(context: Any, builder: Any, array_type: Any, data: Any, shape: list[Any]) -> Any:
    """An array at an address, built in registers: no call, no reference count."""
    itemsize = _WORD(as_dtype(array_type.dtype).itemsize)
    strides = [itemsize]
    for length in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], length))
    array = make_array(array_type)(context, builder)
    populate_array(array, data=data, shape=shape, strides=strides, itemsize=itemsize, meminfo=None)
    return array._getvalue()


@intrinsic
def _world_in_kernel(typingctx, row, parameters, scratch, actions, layout):
    def codegen(context, builder, signature, args):
        return _packed(context, builder, world_type, list(args))

    return world_type(*[types.int64] * 5), codegen


def _trackers_in_kernel(group: str) -> Any:
    @intrinsic
    def group_of(typingctx, world, tracker):
        def codegen(context, builder, signature, args):
            world, tracker = args
            row, layout = (builder.extract_value(world, i) for i in (ROW, len(BUFFERS)))
            second_line = builder.add(layout, _WORD(8 * MOST_SLOTS))
            step = builder.mul(tracker, _table_entry(builder, second_line, TRACKER_BYTES))
            is_own = builder.icmp_signed(">=", tracker, _WORD(0))
            moved = builder.select(is_own, builder.add(row, step), row)
            world = builder.insert_value(world, moved, ROW)
            return builder.insert_value(world, builder.select(is_own, second_line, layout), len(BUFFERS))

        return _GroupType(group)(world_type, types.int64), codegen

    return group_of


def _array_at(dtype: Any) -> Any:
    """An intrinsic `(address, count) -> array[count]`."""
    array_type = types.Array(numba.from_dtype(np.dtype(dtype)), 1, "C")

    @intrinsic
    def array_at(typingctx, address, count):
        def codegen(context, builder, signature, args):
            pointer = builder.inttoptr(args[0], context.get_data_type(array_type.dtype).as_pointer())
            return _array(context, builder, array_type, pointer, [args[1]])

        return array_type(types.int64, types.int64), codegen

    return array_at


# --- the same without the compiler ---


def _cut(address: int, dtype: Any, shape: tuple[int, ...]) -> np.ndarray:
    size = int(np.prod(shape, dtype=np.int64)) * np.dtype(dtype).itemsize
    memory: Any = (ctypes.c_char * size).from_address(int(address))
    return np.frombuffer(memory, dtype).reshape(shape)


class World:
    """Five addresses; its attributes are groups of fields."""

    def __init__(self, row: int, parameters: int, scratch: int, actions: int, layout: int):
        self._addresses = (row, parameters, scratch, actions, layout)

    def __iter__(self) -> Any:
        return iter(self._addresses)

    def __getattr__(self, group: str) -> Any:
        if group not in GROUPS:
            raise AttributeError(group)
        return _Group(self._addresses, group)


class _Group:
    def __init__(self, addresses: tuple[int, ...], group: str):
        self.__dict__.update(_addresses=addresses, _fields=GROUPS[group])

    def _view(self, attribute: str) -> np.ndarray:
        field, table = self._fields[attribute], _cut(self._addresses[-1], np.int64, (MOST_SLOTS,))
        shape = tuple(int(a) if a.isdigit() else int(table[LETTERS[a]]) for a in field.axes)
        return _cut(self._addresses[field.buffer] + table[field.slot], field.dtype, shape)

    def __getattr__(self, attribute: str) -> Any:
        view = self._view(attribute)
        return view if view.ndim else view[()]

    def __setattr__(self, attribute: str, value: Any) -> None:
        self._view(attribute)[...] = value


def trackers(group: str) -> Any:
    """A function `(world, tracker) -> group` for kernels: a group that has a twin, of the central tracker or of
    an agent's own.
    """
    if not INTERPRETED:
        return _trackers_in_kernel(group)

    def group_of(world: World, tracker: int) -> _Group:
        row, *others, layout = world
        if tracker >= 0:
            layout += 8 * MOST_SLOTS
            row += tracker * int(_cut(layout, np.int64, (MOST_SLOTS,))[TRACKER_BYTES])
        return _Group((row, *others, layout), group)

    return group_of


world_at: Any = World if INTERPRETED else _world_in_kernel
"""A world from its five addresses, in a kernel."""
ints_at: Any = (lambda a, n: _cut(a, np.int64, (int(n),))) if INTERPRETED else _array_at(np.int64)
"""`int64[count]` at an address, in a kernel."""
floats_at: Any = (lambda a, n: _cut(a, np.float64, (int(n),))) if INTERPRETED else _array_at(np.float64)
"""`float64[count]` at an address, in a kernel."""
