"""The file of a learned policy: tensors and a plain config in one safetensors file. No code, no pickle.

Whoever wrote a file, reading it runs nothing and builds nothing but arrays and one of the built-in views; all
of it is checked against the table below, and what does not fit raises ValueError.

The tensors of a network of `layers` [inputs, h_0, ..., outputs], float32 (obs_* may be float64):

    pi.i.weight [h_i, h_{i-1}], pi.i.bias [h_i]      i = 0, 1, ...; `activation` after each
    action.weight [outputs, h_last], action.bias [outputs]
    log_std [outputs]                                where `choices` is None: mean and deviation of an action
    obs_mean [inputs], obs_var [inputs]              both or neither

The config, a JSON text under the key "trust_env" of the file's metadata:

    format        1
    view          the action view by its name, such as phantoms(n=4)
    knowledge     the level at which the policy was trained, and which it needs
    fields        {name: entries}, the fields of the observation that the view reads
    layers        [inputs, ..., outputs]
    activation    tanh | relu
    choices       None: a Box of `outputs` entries; else the sizes of a MultiDiscrete, whose sum is `outputs`
    about         where it comes from: {scenario, defense, seed, steps, package, ...}, texts and numbers
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import safetensors
import safetensors.numpy

from trust_env.agents.wrappers import VIEWS, build_view
from trust_env.files import write_atomically
from trust_env.spaces.observation import KNOWLEDGE, NAMES
from trust_env.spec import parse

FILE = "policy.safetensors"  # in a run folder
FORMAT = 1
ACTIVATIONS = ("tanh", "relu")
MOST_BYTES, MOST_HEADER = 64 << 20, 1 << 20
MOST_LAYERS, MOST_WIDTH, MOST_TEXT, MOST_FACTS = 16, 65536, 2000, 64
MOST_LOG_STD, MOST_PARAMETER = 20.0, 1000
_KEY = "trust_env"
_FOREIGN = {  # what a file begins with, and what it then is
    b"PK\x03\x04": "a zip archive, as Stable-Baselines3 and PyTorch write them",
    b"\x80": "a pickle",
}

Tensors = dict[str, np.ndarray]


def policy_file(path: str | Path) -> Path:
    """The policy file that a path names: itself, or the one in a run folder. ValueError: there is none."""
    given = Path(path).expanduser()
    if given.is_dir() and not (given / FILE).is_file():
        raise ValueError(f"{given}: there is no {FILE} in this folder; expected the folder of a training run")
    file = given / FILE if given.is_dir() else given
    if not file.is_file():
        raise ValueError(
            f"{given}: there is no such file; expected a {FILE}, or the folder of a training run"
        )
    return file


def save_policy(path: str | Path, tensors: Mapping[str, np.ndarray], config: Mapping[str, Any]) -> None:
    """Write a policy file (of a folder: its policy.safetensors), complete or not at all.

    tensors, config: as above; `format` may be left out. Raises ValueError for what `load_policy` refuses.
    """
    config = json.loads(json.dumps({"format": FORMAT, **config}))
    arrays = {name: np.ascontiguousarray(tensors[name]) for name in sorted(tensors)}
    _check(arrays, config)
    data = safetensors.numpy.save(arrays, {_KEY: json.dumps(config)})
    file = Path(path).expanduser()
    file = file / FILE if file.is_dir() else file
    write_atomically(file, lambda path: path.write_bytes(data))


def load_policy(path: str | Path) -> tuple[Tensors, dict[str, Any]]:
    """Tensors and config of a policy file, or of a run folder.

    Raises ValueError, naming the file and what was expected, for anything that is not what stands above.
    """
    file = policy_file(path)
    with open(file, "rb") as opened:
        data = opened.read(MOST_BYTES + 1)
    try:
        config = _config(data)
        tensors = safetensors.numpy.load(data)
        _check(tensors, config)
    except (ValueError, safetensors.SafetensorError) as fault:
        raise ValueError(f"{file}: not the file of a learned policy: {fault}") from None
    return tensors, config


def _config(data: bytes) -> dict[str, Any]:
    """What the header says of the policy; refuses a header with which safetensors should not be troubled."""
    size = int.from_bytes(data[:8], "little")
    for start, what in _FOREIGN.items():
        if data.startswith(start) and size > MOST_HEADER:
            raise ValueError(f"it is {what}; expected a safetensors file")
    if not 8 < len(data) <= MOST_BYTES:
        raise ValueError(f"it has {len(data)} bytes; expected a safetensors file of at most {MOST_BYTES}")
    if size > min(MOST_HEADER, len(data) - 8):
        limit = f"at most {MOST_HEADER}, and no more than the file's {len(data)}"
        raise ValueError(
            f"its header has {size} bytes; expected {limit}: a safetensors file that is complete"
        )
    header = _json("header", data[8 : 8 + size])
    metadata = header.pop("__metadata__", None)
    if not isinstance(metadata, dict) or not isinstance(metadata.get(_KEY), str):
        raise ValueError(f"its metadata has no text {_KEY!r}; expected the config of a policy there")
    for name, entry in header.items():
        dtype = entry.get("dtype") if isinstance(entry, dict) else None
        if dtype not in ("F32", "F64"):
            raise ValueError(f"tensor {_short(name)} has dtype {_short(dtype)}; expected F32")
    return _json(_KEY, metadata[_KEY].encode())


def _json(what: str, text: bytes) -> dict[str, Any]:
    try:
        found = json.loads(text.decode())
    except (ValueError, RecursionError) as fault:
        raise ValueError(f"{what}: expected JSON; {fault}") from None
    if not isinstance(found, dict):
        raise ValueError(f"{what} = {_short(found)}: expected a dict")
    return found


def _check(tensors: Mapping[str, np.ndarray], config: Mapping[str, Any]) -> None:
    for key in config:
        if key not in _CONFIG:
            raise ValueError(f"config: unknown key {_short(key)}; known: {', '.join(_CONFIG)}")
    for key, (fits, expected) in _CONFIG.items():
        if key not in config:
            raise ValueError(f"config: {key} is missing; expected {expected}")
        if not fits(config[key]):
            raise ValueError(f"config: {key} = {_short(config[key])}: expected {expected}")
    outputs, choices = config["layers"][-1], config["choices"]
    if choices is not None and sum(choices) != outputs:
        raise ValueError(f"config: choices = {_short(choices)}: expected sizes that sum to {outputs}")
    _check_tensors(tensors, tensor_shapes(config["layers"], choices, "obs_mean" in tensors))


def tensor_shapes(
    layers: list[int], choices: list[int] | None, normalised: bool
) -> dict[str, tuple[int, ...]]:
    """The tensors of a policy and their shapes, by name."""
    shapes: dict[str, tuple[int, ...]] = {}
    for i, (before, after) in enumerate(pairwise(layers)):
        name = "action" if i == len(layers) - 2 else f"pi.{i}"
        shapes |= {f"{name}.weight": (after, before), f"{name}.bias": (after,)}
    shapes |= {"log_std": (layers[-1],)} if choices is None else {}
    return shapes | ({"obs_mean": (layers[0],), "obs_var": (layers[0],)} if normalised else {})


def _check_tensors(tensors: Mapping[str, np.ndarray], shapes: Mapping[str, tuple[int, ...]]) -> None:
    for name in {**shapes, **tensors}:
        if name not in tensors:
            raise ValueError(f"tensor {name} is missing; expected {', '.join(shapes)}")
        if name not in shapes:
            raise ValueError(f"unknown tensor {_short(name)}; expected {', '.join(shapes)}")
        values, wide = tensors[name], name.startswith("obs_")
        if values.dtype not in (np.float32, np.float64 if wide else np.float32):
            expected = "float32 or float64" if wide else "float32"
            raise ValueError(f"tensor {name} has dtype {values.dtype}; expected {expected}")
        if values.shape != shapes[name]:
            raise ValueError(f"tensor {name} has shape {list(values.shape)}; expected {list(shapes[name])}")
        if not np.isfinite(values).all():
            raise ValueError(f"tensor {name} has entries that are not finite; expected finite numbers")
    if "obs_var" in tensors and tensors["obs_var"].min() < 0.0:
        raise ValueError("tensor obs_var has negative entries; expected variances")
    if "log_std" in tensors and np.abs(tensors["log_std"]).max() > MOST_LOG_STD:
        raise ValueError(f"tensor log_std has large entries; expected at most {MOST_LOG_STD:g} in size")


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def _is_whole(value: Any, most: int) -> bool:
    return type(value) is int and 1 <= value <= most


def _are_whole(value: Any, least: int) -> bool:
    fits = isinstance(value, list) and least <= len(value) <= MOST_WIDTH
    return fits and all(_is_whole(entry, MOST_WIDTH) for entry in value)


def _is_view(value: Any) -> bool:
    """A built-in view by its name; a file of somebody's is never run."""
    if not isinstance(value, str) or len(value) > MOST_TEXT:
        return False
    try:
        spec = parse(value)
        plain = spec.path is None and all(map(_is_plain, spec.params.values()))
        return plain and spec.name in VIEWS and build_view(value) is not None
    except (ValueError, TypeError):
        return False


def _is_plain(value: Any) -> bool:
    """A word, or a number of no more than a view has use for: it may allocate as much."""
    match value:
        case str():
            return re.fullmatch(r"\w*", value) is not None
        case int():
            return abs(value) <= MOST_PARAMETER
    return value is None or isinstance(value, float)


def _are_fields(value: Any) -> bool:
    return isinstance(value, dict) and all(k in NAMES and _is_whole(v, MOST_WIDTH) for k, v in value.items())


def _are_facts(value: Any) -> bool:
    return (
        isinstance(value, dict) and len(value) <= MOST_FACTS and all(map(_is_fact, [*value, *value.values()]))
    )


def _is_fact(value: Any) -> bool:
    match value:
        case None | bool():
            return True
        case str():
            return len(value) <= MOST_TEXT
        case int() | float():
            return math.isfinite(value) and abs(value) < 2**63
    return False


_CONFIG: dict[str, tuple[Callable[[Any], bool], str]] = {
    "format": (lambda v: type(v) is int and v == FORMAT, f"{FORMAT}, the only format there is"),
    "view": (_is_view, f"one of the built-in views, {', '.join(VIEWS)}, with parameters that it takes"),
    "knowledge": (lambda v: isinstance(v, str) and v in KNOWLEDGE, f"one of {', '.join(KNOWLEDGE)}"),
    "fields": (_are_fields, "the names of fields of the observation with their numbers of entries"),
    "layers": (
        lambda v: _are_whole(v, 2) and len(v) <= MOST_LAYERS,
        f"2 to {MOST_LAYERS} whole numbers of 1 to {MOST_WIDTH}",
    ),
    "activation": (lambda v: isinstance(v, str) and v in ACTIVATIONS, f"one of {', '.join(ACTIVATIONS)}"),
    "choices": (lambda v: v is None or _are_whole(v, 1), "null, or a list of whole numbers of at least 1"),
    "about": (_are_facts, f"a dict of at most {MOST_FACTS} texts and finite numbers"),
}
