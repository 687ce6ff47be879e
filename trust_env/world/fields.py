"""Where everything lies in memory.

A world is one row of bytes, `rows[W, row_bytes]`; what all worlds share is one more buffer, `params`, and
what a frame scribbles on is a third, `scratch` (one per thread). Kernels receive a `World`, four addresses,
and cut typed array views out of it by field:

    mean = floats2(world, F.track_mean)    # [J, 4]

A view costs a few additions, so every kernel starts with the list of the arrays it touches. Copying a row
copies a world. The letters in the shapes are those of the documentation: K agents, N targets, D detections of
an agent, J central tracks, L local tracks, M injection slots, A action entries, O observation entries, V
polygon vertices, T recorded frames, H frames of a defense's memory.
"""

from __future__ import annotations

import ctypes
from collections import namedtuple
from collections.abc import Mapping
from types import ModuleType
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from trust_env.compiled.jit import inlined

ROW, PARAMS, SCRATCH = 0, 1, 2

PARAM_FIELDS = {
    # limits and switches                                     the codes are those of `params.py`
    "horizon": "i8", "knowledge": "i8", "shared": "i8", "actuation": "i8", "full_evidence": "i8",
    "confirmation": "i8", "confirm_m": "i8", "confirm_n": "i8", "confirm_hits": "i8",
    "deletion": "i8", "max_unseen": "i8",
    "target_source": "i8", "defense": "i8",
    # targets
    "area": "f8 4", "speed": "f8 2", "initial_probability": "f8", "birth_rate": "f8", "death_rate": "f8",
    "target_noise": "f8", "start_state": "f8 N 4", "record": "f8 T N 4", "placement": "i8", "spread": "f8",
    # agents: sensing, threat model
    "role": "i8 K", "start_pose": "f8 K 3", "pose_drawn": "b1 K",
    "fov_type": "i8 K", "fov_radius": "f8 K", "fov_heading": "f8 K", "fov_half_width": "f8 K",
    "fov_vertices": "f8 K V 2", "fov_sides": "i8 K",
    "clutter_mean": "f8 K", "p_detect": "f8 K", "noise_cov": "f8 K 2 2", "noise_chol": "f8 K 2 2",
    "injection_budget": "i8 K", "suppression_budget": "i8 K",
    # what the tracker believes
    "initial_score": "f8 K", "hit_constant": "f8 K", "miss_gain": "f8 K",
    "process_noise": "f8", "velocity_variance": "f8", "gate": "f8",
    "confirm_threshold": "f8", "delete_threshold": "f8", "confirmed_drop": "f8", "tentative_drop": "f8",
    # evidence, metrics, rewards, observations
    "near_distance": "f8", "hold_distance": "f8", "match_distance": "f8", "cutoff": "f8", "order": "f8",
    "reward_false_track": "f8", "reward_missing_target": "f8", "reward_lost_trust": "f8",
    "extent_centre": "f8 2", "extent_half": "f8", "speed_scale": "f8", "observation_offset": "i8 32",
    # defenses
    "defense_params": "f8 32", "agent_prior": "f8 K 2",
}  # fmt: skip

_TRACKER = {
    "id": "i8", "status": "i8", "mean": "f8 4", "cov": "f8 4 4", "score": "f8", "initial": "f8", "peak": "f8",
    "age": "i8", "unseen": "i8", "hits": "i8", "window": "i8", "hit_now": "b1", "doomed": "b1",
}  # fmt: skip


def _tracker_fields(prefix: str, axes: str) -> dict[str, str]:
    return {
        f"{prefix}_{name}": " ".join([*kind.split()[:1], axes, *kind.split()[1:]])
        for name, kind in _TRACKER.items()
    }


ROW_FIELDS = {
    # which world this is, and what every step hands out: `HEAD`
    "seed": "i8", "world_id": "i8", "episode": "i8", "frame": "i8", "active": "i8", "dt": "f8",
    "reward": "f8 K", "metrics": "f8 8", "agent_trust": "f8 K",
    # agents and targets
    "pose": "f8 K 3", "fov_box": "f8 K 4", "target_alive": "b1 N", "target_state": "f8 N 4",
    "judged_alive": "b1 N", "judged_state": "f8 N 4", "judged_visible": "b1 N", "judged_confirmed": "b1 J",
    # detections as sensed (raw) and as reported
    "raw_count": "i8 K", "raw_detections": "f8 K D 2", "raw_origin": "i8 K D",
    "report_count": "i8 K", "reports": "f8 K D 2", "report_origin": "i8 K D", "overflow": "i8 4",
    # trackers: the central one and one per agent
    "columns": "i8 K+1", "next_id": "i8 K+1",
    **_tracker_fields("track", "J"), "track_injected_hits": "i8 J",
    **_tracker_fields("local", "K L"),
    # evidence
    "expected": "b1 K J", "detected": "b1 K J", "held": "b1 K J",
    "assignment": "i8 K D", "agent_score": "f8 K J",
    # verdict and picture
    "track_trust": "f8 J", "track_trust_var": "f8 J", "agent_trust_var": "f8 K",
    "publish": "b1 J", "keep": "b1 J", "agent_weight": "f8 K", "published": "b1 J",
    "last_agent_trust": "f8 K",
    # what built-in defenses remember
    "belief_id": "i8 J", "track_belief": "f8 J 2", "agent_belief": "f8 K 2",
    # outcome of the frame
    "track_target": "i8 J", "track_label": "i8 J", "track_injected": "b1 J",
    # the players' side
    "action": "f8 K A", "observation": "f4 K O",
    # what only some defenses need: last, so that the other worlds stay close together
    "fov_run": "i8 K J", "vote": "f8 H J", "agreement": "f8 H K 2",
    "innovation": "f8 K J 2", "innovation_cov": "f8 K J 2 2", "distance2": "f8 K J",
}  # fmt: skip

SCRATCH_FIELDS = {
    "pair_start": "i8 R+1", "pair_column": "i8 P", "pair_cost": "f8 P",
    "row_column": "i8 R", "column_row": "i8 C", "column_degree": "i8 C",
    "row_potential": "f8 R", "column_potential": "f8 C",
    "path_cost": "f8 C", "path_row": "i8 C", "touched": "i8 C", "done": "b1 C",
    "scan_geometry": "f8 C 7", "scan_columns": "i8 C", "scan_inside": "b1 C", "scan_gain": "f8 C",
    "rank": "f8 D", "scan_assignment": "i8 R", "listing": "i8 C", "estimates": "f8 R 2", "truths": "f8 C 2",
}  # fmt: skip

HEAD = ("seed", "world_id", "episode", "frame", "reward", "metrics", "agent_trust")
METRICS = (
    "false_tracks",
    "injected_tracks",
    "missing_targets",
    "visible_targets",
    "published_tracks",
    "gospa",
    "ospa",
    "gospa_localisation",
)

_ALL = [
    (name, kind, buffer)
    for buffer, fields in ((ROW, ROW_FIELDS), (PARAMS, PARAM_FIELDS), (SCRATCH, SCRATCH_FIELDS))
    for name, kind in fields.items()
]
N_FIELDS = len(_ALL)
# A module, as its attributes are constants for the compiler, and a tuple of this length takes it long.
F: Any = ModuleType(
    "trust_env.core.layout.F", "The fields by name, `F.track_mean`; numbers, in the order of the tables."
)
F.__dict__.update({name: index for index, (name, _, _) in enumerate(_ALL)})

World = namedtuple("World", "row params scratch layout")  # addresses


def _shape(kind: str, dims: Mapping[str, int]) -> tuple[int, ...]:
    shape = []
    for axis in kind.split()[1:]:
        letter, _, extra = axis.partition("+")
        shape.append((int(letter) if letter.isdigit() else dims[letter]) + int(extra or 0))
    return tuple(shape)


_CACHE_LINE = 64  # bytes


def _round_up(size: int, step: int) -> int:
    return -(-size // step) * step


def aligned_zeros(count: int, size: int) -> np.ndarray:
    """uint8[count, size] that begins with a cache line; fields as long as one then do, too."""
    raw = np.zeros(count * size + _CACHE_LINE, dtype=np.uint8)
    first = -raw.ctypes.data % _CACHE_LINE
    return raw[first : first + count * size].reshape(count, size)


class Layout:
    """Offsets of every field for given dimensions.

    `table[N_FIELDS, 6]`: buffer, byte offset, and the shape padded with ones, as kernels read it.
    """

    def __init__(self, dims: Mapping[str, int]):
        self.dims = dict(dims)
        self.table = np.zeros((N_FIELDS, _LINE), dtype=np.int64)
        self.kinds: dict[str, tuple[int, int, np.dtype, tuple[int, ...]]] = {}
        sizes = [0, 0, 0]
        for index, (name, kind, buffer) in enumerate(_ALL):
            dtype, shape = np.dtype(kind.split()[0]), _shape(kind, dims)
            size = int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
            offset = _round_up(sizes[buffer], _CACHE_LINE if size >= _CACHE_LINE else 8)
            padded = (*shape, 1, 1, 1, 1)[:4]
            self.table[index] = (buffer, offset, *padded)
            self.kinds[name] = (buffer, offset, dtype, shape)
            sizes[buffer] = offset + size
        self.row_bytes, self.param_bytes, self.scratch_bytes = (
            _round_up(max(size, 1), _CACHE_LINE) for size in sizes
        )

    def view(self, buffer: np.ndarray, name: str) -> np.ndarray:
        """The live NumPy view of a field in `buffer[bytes]`, or with a leading W in `buffer[W, bytes]`."""
        _, offset, dtype, shape = self.kinds[name]
        strides = [
            dtype.itemsize * int(np.prod(shape[axis + 1 :], dtype=np.int64)) for axis in range(len(shape))
        ]
        lead = buffer.shape[:-1]
        return np.ndarray(lead + shape, dtype, buffer.data, offset, (*buffer.strides[:-1], *strides))

    @property
    def head(self) -> np.dtype:
        """The beginning of a world's row, with the fields that every step hands out, as a record."""
        kinds = [self.kinds[name] for name in HEAD]
        formats, offsets = [(dtype, shape) for *_, dtype, shape in kinds], [offset for _, offset, *_ in kinds]
        return np.dtype({"names": HEAD, "formats": formats, "offsets": offsets})


# --- cutting views inside kernels
# ---------------------------------------------------------------------------------------------


def _build_array(context, builder, array_type, itemsize, address, shape):
    """An array view at an address, built in registers: no call, no reference count."""
    strides = [itemsize]
    for length in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], length))
    array = make_array(array_type)(context, builder)
    data = builder.inttoptr(address, context.get_data_type(array_type.dtype).as_pointer())
    populate_array(array, data=data, shape=shape, strides=strides, itemsize=itemsize, meminfo=None)
    return array._getvalue()


_LINE = 6  # numbers in a field's line: buffer, byte offset, shape


def _fixed_lines() -> list[list[int]]:
    """What is known of every field before there are any dimensions: its buffer, no offset, and those lengths
    that the table of fields gives as numbers; -1 where it takes the dimensions to know.
    """
    lines = []
    for _, kind, buffer in _ALL:
        lengths = [int(axis) if axis.isdigit() else -1 for axis in kind.split()[1:]]
        lines.append([buffer, -1, *lengths, 1, 1, 1, 1][:_LINE])
    return lines


def _fixed_table(builder):
    """`_fixed_lines` as a constant of the module, for the compiler to read, so that the kernel need not."""
    word, module, name = ir.IntType(64), builder.module, "trust_env.fields"
    if name in module.globals:
        return module.globals[name]
    numbers = [number for line in _fixed_lines() for number in line]
    table: Any = ir.GlobalVariable(module, ir.ArrayType(word, len(numbers)), name)
    table.initializer = ir.Constant(table.value_type, numbers)
    table.global_constant, table.linkage = True, "internal"
    return table


def _load_entry(builder, layout, field, count):
    """The first `count` numbers of a field's line in the layout; it never changes, so loads of it may be
    merged and moved.
    """
    word, constant = ir.IntType(64), builder.module.add_metadata([])
    fixed, first = _fixed_table(builder), builder.mul(field, word(_LINE))
    line, entry = builder.gep(builder.inttoptr(layout, word.as_pointer()), [first]), []
    for i in range(count):
        known = builder.load(builder.gep(fixed, [word(0), builder.add(first, word(i))]))
        loaded = builder.load(builder.gep(line, [word(i)]))
        loaded.set_metadata("invariant.load", constant)
        entry.append(builder.select(builder.icmp_signed(">=", known, word(0)), known, loaded))
    return entry


def _array_type(dtype: Any, ndim: int) -> Any:
    return types.Array(numba.from_dtype(np.dtype(dtype)), ndim, "C")


_WORLD_TYPE = types.NamedUniTuple(types.int64, 4, World)


def _view_in_kernel(dtype: Any, ndim: int) -> Any:
    """An intrinsic `(world, field) -> array`."""
    array_type, itemsize = _array_type(dtype, ndim), np.dtype(dtype).itemsize

    def codegen(context, builder, signature, args):
        word = ir.IntType(64)
        row, params, scratch, layout = (builder.extract_value(args[0], i) for i in range(4))
        buffer, offset, *shape = _load_entry(builder, layout, args[1], 2 + ndim)
        is_row, is_params = (builder.icmp_signed("==", buffer, word(code)) for code in (ROW, PARAMS))
        base = builder.select(is_row, row, builder.select(is_params, params, scratch))
        return _build_array(context, builder, array_type, word(itemsize), builder.add(base, offset), shape)

    def view(typingctx, world, field):
        return array_type(_WORLD_TYPE, types.int64), codegen

    return intrinsic(view)


def _tracker_view_in_kernel(dtype: Any, ndim: int) -> Any:
    """An intrinsic `(world, tracker, field) -> array`: the central tracker's field (tracker -1), or the same
    of agent `tracker`'s own.
    """
    array_type, itemsize = _array_type(dtype, ndim), np.dtype(dtype).itemsize

    def codegen(context, builder, signature, args):
        word = ir.IntType(64)
        world, tracker, field = args
        row, layout = builder.extract_value(world, 0), builder.extract_value(world, 3)
        _, central, *shape = _load_entry(builder, layout, field, 2 + ndim)
        _, first, _, columns = _load_entry(builder, layout, builder.add(field, word(_LOCAL)), 4)
        stride = builder.mul(columns, word(itemsize))
        for length in shape[1:]:
            stride = builder.mul(stride, length)
        is_local = builder.icmp_signed(">=", tracker, word(0))
        offset = builder.select(is_local, builder.add(first, builder.mul(tracker, stride)), central)
        shape[0] = builder.select(is_local, columns, shape[0])
        return _build_array(context, builder, array_type, word(itemsize), builder.add(row, offset), shape)

    def view(typingctx, world, tracker, field):
        return array_type(_WORLD_TYPE, types.int64, types.int64), codegen

    return intrinsic(view)


@intrinsic
def _ints_at_in_kernel(typingctx, address, count):
    """`int64[count]` at an address."""
    array_type = _array_type(np.int64, 1)

    def codegen(context, builder, signature, args):
        return _build_array(context, builder, array_type, ir.IntType(64)(8), args[0], [args[1]])

    return array_type(types.int64, types.int64), codegen


def _ints_at_in_python(address: int, count: int) -> np.ndarray:
    memory: Any = (ctypes.c_int64 * count).from_address(int(address))
    return np.frombuffer(memory, np.int64)


def _view_in_python(dtype: Any, ndim: int) -> Any:
    """The same as `_view_in_kernel` without the compiler (NUMBA_DISABLE_JIT=1)."""

    def view(world, field):
        table: Any = (ctypes.c_int64 * (_LINE * N_FIELDS)).from_address(int(world.layout))
        entry = np.frombuffer(table, np.int64).reshape(-1, _LINE)[field]
        shape, base = entry[2 : 2 + ndim], world[entry[0]]
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize
        memory: Any = (ctypes.c_char * size).from_address(int(base + entry[1]))
        return np.frombuffer(memory, dtype).reshape(shape)

    return view


def _tracker_view_in_python(dtype: Any, ndim: int) -> Any:
    central, local = _view_in_python(dtype, ndim), _view_in_python(dtype, ndim + 1)
    return lambda world, tracker, field: (
        central(world, field) if tracker < 0 else local(world, field + _LOCAL)[tracker]
    )


_LOCAL = F.local_id - F.track_id  # from a field of the central tracker to the same field of the local ones
_JIT_OFF = bool(numba.config.DISABLE_JIT)  # pyright: ignore[reportAttributeAccessIssue, reportPrivateImportUsage]
_view = _view_in_python if _JIT_OFF else _view_in_kernel
_tracker_view = _tracker_view_in_python if _JIT_OFF else _tracker_view_in_kernel
floats1, floats2, floats3, floats4 = (_view(np.float64, ndim) for ndim in (1, 2, 3, 4))
ints1, ints2 = (_view(np.int64, ndim) for ndim in (1, 2))
flags1, flags2 = (_view(np.bool_, ndim) for ndim in (1, 2))
singles2 = _view(np.float32, 2)
ints_at: Any = _ints_at_in_python if _JIT_OFF else _ints_at_in_kernel
bytes1, bytes2 = (_view(np.uint8, ndim) for ndim in (1, 2))  # for their shapes
tracker_floats1, tracker_floats2, tracker_floats3 = (_tracker_view(np.float64, ndim) for ndim in (1, 2, 3))
tracker_ints1, tracker_flags1 = _tracker_view(np.int64, 1), _tracker_view(np.bool_, 1)


@inlined
def real(world, field):
    """A float scalar."""
    return floats1(world, field)[0]


@inlined
def whole(world, field):
    """An integer scalar."""
    return ints1(world, field)[0]


@inlined
def shape0(world, field):
    """Length of a field's first axis."""
    return bytes1(world, field).shape[0]


@inlined
def shape1(world, field):
    """Length of a field's second axis."""
    return bytes2(world, field).shape[1]
