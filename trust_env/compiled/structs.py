"""How kernels read memory: by groups of named fields, cut out of rows of bytes where they are asked for.

    tracks = tracks_of(world, tracker)
    tracks.mean[j, 0] += 1.0              # a field with axes is an array
    world.clock.frame += 1                # one without is a number

A `world` is five addresses. `world.agents` is a group of its fields; `world.tracks` are the central tracker's,
`tracks_of(world, tracker)` those of any. A group is five words in registers: passing it on costs nothing, a
field that is not asked for costs nothing, and what is read is what lies there now. Which fields there are is
declared by `declare`; where each lies is a table of numbers, made for given lengths of the axes by `Layout`.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

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

from trust_env.compiled.mode import INTERPRETED

BUFFERS = ("row", "parameters", "scratch", "actions")
ROW, PARAMETERS, SCRATCH, ACTIONS = range(4)
CENTRAL = -1  # the number of the central tracker; those of the agents' own are the agents'
_CACHE_LINE = 64  # bytes
_MOST_SLOTS = 512  # of a line of a layout's table


class Field(NamedTuple):
    """A field: `slot` is the place of its offset in a layout's table; an axis is a length or a letter."""

    name: str  # among all fields
    buffer: int
    dtype: np.dtype
    axes: tuple[str, ...]
    slot: int
    line: int  # of the table: 1 for what every agent's own tracker has
    meaning: str

    @property
    def is_number(self) -> bool:
        return not self.axes


GROUPS: dict[str, dict[str, Field]] = {}
LETTERS: dict[str, int] = {}  # of axes, with the place of their length in a layout's table
_slots = 0


def declare(group: str, prefix: str, buffer: int, fields: Mapping[str, str], twin: str = "") -> None:
    """Add fields to a group: `{"mean": "f8 J 4 | m, m/s: x, y, vx, vy"}`, type, axes, meaning.

    Outside kernels a field is known as `prefix` and its name. What is declared again must be the same. twin: the
    group whose fields these are once more, one set for every agent.
    """
    members = GROUPS.setdefault(group, {})
    for attribute, text in fields.items():
        kind, _, meaning = text.partition("|")
        dtype, *axes = kind.split()
        for letter in (axis for axis in axes if not axis.isdigit()):
            if letter not in LETTERS:
                LETTERS[letter] = _new_slot()
        known, original = members.get(attribute), GROUPS[twin][attribute] if twin else None
        slot = known.slot if known else original.slot if original else _new_slot()
        line, name = int(bool(twin)), prefix + attribute
        field = Field(name, buffer, np.dtype(dtype), tuple(axes), slot, line, meaning.strip())
        if known and known != field:
            raise ValueError(f"{group}.{attribute} is declared twice: as {known} and as {field}")
        members[attribute] = field


def _new_slot() -> int:
    global _slots
    _slots += 1
    if _slots > _MOST_SLOTS:
        raise ValueError(f"more than {_MOST_SLOTS} fields and axes are declared")
    return _slots - 1


_TRACKER_BYTES = _new_slot()  # of one agent's own tracker


def declarations() -> str:
    """All that compiled code knows of the fields, as text: what it is compiled for."""
    return repr((GROUPS, LETTERS))


# --- where everything lies ---


def _round_up(size: int, step: int) -> int:
    return -(-size // step) * step


def aligned_zeros(count: int, size: int) -> np.ndarray:
    """uint8[count, size] that begins with a cache line; fields as long as one then do, too."""
    raw = np.zeros(count * size + _CACHE_LINE, dtype=np.uint8)
    first = -raw.ctypes.data % _CACHE_LINE
    return raw[first : first + count * size].reshape(count, size)


class Layout:
    """Offsets of all fields of some groups for given lengths of the axes.

    `table[2, slots]`: the offset of every field and the length of every axis, as kernels read them; in the second
    line, of the agents' own trackers, where the first of them has a field. own_tracks: the axis of their tracks,
    where the central tracker has J.
    """

    def __init__(self, lengths: Mapping[str, int], groups: Iterable[str], own_tracks: str = "L"):
        self._lengths, self.sizes = dict(lengths), [0] * len(BUFFERS)
        self.table = np.full((2, _MOST_SLOTS), -1, dtype=np.int64)
        for letter, slot in LETTERS.items():
            self.table[:, slot] = lengths.get(letter, -1), lengths.get(own_tracks if letter == "J" else letter, -1)
        self.fields = {field.name: field for group in groups for field in GROUPS[group].values()}
        own = [field for field in self.fields.values() if field.line]
        tracker_bytes = self._place(own, 0)
        self.table[1, _TRACKER_BYTES] = tracker_bytes
        for buffer in range(len(BUFFERS)):
            fields = [field for field in self.fields.values() if field.buffer == buffer and not field.line]
            self.sizes[buffer] = self._place(fields, 0)
        # The agents' own trackers, one whole tracker after the other, come last in the row.
        for field in own:
            self.table[1, field.slot] += self.sizes[ROW]
        self.sizes[ROW] += tracker_bytes * (lengths["K"] if own else 0)

    def _place(self, fields: Iterable[Field], end: int) -> int:
        """Give each field its offset, one after the other; returns where they end, in whole cache lines."""
        for field in fields:
            size = int(np.prod(self._shape(field)[field.line :], dtype=np.int64)) * field.dtype.itemsize
            offset = _round_up(end, _CACHE_LINE if size >= _CACHE_LINE else 8)
            self.table[field.line, field.slot], end = offset, offset + size
        return _round_up(max(end, 1), _CACHE_LINE)

    def _shape(self, field: Field) -> tuple[int, ...]:
        return tuple(int(axis) if axis.isdigit() else self._lengths[axis] for axis in field.axes)

    def view(self, buffer: np.ndarray, name: str) -> np.ndarray:
        """The live NumPy view of a field in `buffer[bytes]`, or with a leading W in `buffer[W, bytes]`."""
        field = self.fields[name]
        shape, size = self._shape(field), field.dtype.itemsize
        strides = [size * int(np.prod(shape[axis + 1 :], dtype=np.int64)) for axis in range(len(shape))]
        if field.line:
            strides[0] = int(self.table[1, _TRACKER_BYTES])
        lead, offset = buffer.shape[:-1], int(self.table[field.line, field.slot])
        strides = (*buffer.strides[:-1], *strides)
        return np.ndarray(lead + shape, field.dtype, buffer.data, offset, strides)

    def record(self, names: Iterable[str]) -> np.dtype:
        """The beginning of a row with the given fields, as a record."""
        fields = [self.fields[name] for name in names]
        return np.dtype({
            "names": [field.name for field in fields],
            "formats": [(field.dtype, self._shape(field)) for field in fields],
            "offsets": [int(self.table[0, field.slot]) for field in fields],
        })  # fmt: skip


# --- in kernels ---

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
            second_line = builder.add(layout, _WORD(8 * _MOST_SLOTS))
            step = builder.mul(tracker, _table_entry(builder, second_line, _TRACKER_BYTES))
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
        field, table = self._fields[attribute], _cut(self._addresses[-1], np.int64, (_MOST_SLOTS,))
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
            layout += 8 * _MOST_SLOTS
            row += tracker * int(_cut(layout, np.int64, (_MOST_SLOTS,))[_TRACKER_BYTES])
        return _Group((row, *others, layout), group)

    return group_of


world_at: Any = World if INTERPRETED else _world_in_kernel
"""A world from its five addresses, in a kernel."""
ints_at: Any = (lambda a, n: _cut(a, np.int64, (int(n),))) if INTERPRETED else _array_at(np.int64)
"""`int64[count]` at an address, in a kernel."""
floats_at: Any = (lambda a, n: _cut(a, np.float64, (int(n),))) if INTERPRETED else _array_at(np.float64)
"""`float64[count]` at an address, in a kernel."""
