"""Which fields there are, and where each lies: declarations by name, offsets for given lengths of the axes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

BUFFERS = ("row", "parameters", "scratch", "actions")
ROW, PARAMETERS, SCRATCH, ACTIONS = range(4)
_CACHE_LINE = 64  # bytes
_OWN_AXES = {"J": "L"}  # the axis that an agent's own tracker has in place of the central one's
MOST_SLOTS = 512  # of a line of a layout's table


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
    if _slots > MOST_SLOTS:
        raise ValueError(f"more than {MOST_SLOTS} fields and axes are declared")
    return _slots - 1


TRACKER_BYTES = _new_slot()  # of one agent's own tracker


def declarations() -> str:
    """All that compiled code knows of the fields, as text: what it is compiled for."""
    return repr((GROUPS, LETTERS))


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
    line, of the agents' own trackers, where the first of them has a field.
    """

    def __init__(self, lengths: Mapping[str, int], groups: Iterable[str]):
        self._lengths, self.sizes = dict(lengths), [0] * len(BUFFERS)
        self.table = np.full((2, MOST_SLOTS), -1, dtype=np.int64)
        for letter, slot in LETTERS.items():
            self.table[:, slot] = lengths.get(letter, -1), lengths.get(_OWN_AXES.get(letter, letter), -1)
        self.fields = {field.name: field for group in groups for field in GROUPS[group].values()}
        own = [field for field in self.fields.values() if field.line]
        tracker_bytes = self._place(own)
        self.table[1, TRACKER_BYTES] = tracker_bytes
        for buffer in range(len(BUFFERS)):
            fields = [field for field in self.fields.values() if field.buffer == buffer and not field.line]
            self.sizes[buffer] = self._place(fields)
        # The agents' own trackers, one whole tracker after the other, come last in the row.
        for field in own:
            self.table[1, field.slot] += self.sizes[ROW]
        self.sizes[ROW] += tracker_bytes * (lengths["K"] if own else 0)

    def _place(self, fields: Iterable[Field]) -> int:
        """Give each field its offset, one after the other; returns where they end, in whole cache lines."""
        end = 0
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
            strides[0] = int(self.table[1, TRACKER_BYTES])
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
