"""What a policy file may hold: its tensors and its config.

The tensors of a network of `layers` [inputs, h_0, ..., outputs], float32 (obs_* may be float64):

    pi.i.weight [h_i, h_{i-1}], pi.i.bias [h_i]      i = 0, 1, ...; `activation` after each
    action.weight [outputs, h_last], action.bias [outputs]
    log_std [outputs]                                where `choices` is None: mean and deviation of an action
    obs_mean [inputs], obs_var [inputs]              both or neither

The config, a JSON text under the key "trust_env" of the file's metadata:

    format        1
    wrapper       the action wrapper by its name, such as phantoms(n=4)
    knowledge     the level at which the policy was trained, and which it needs
    fields        {name: entries}, the fields of the observation that the wrapper reads
    layers        [inputs, ..., outputs]
    activation    tanh | relu
    choices       None: a Box of `outputs` entries; else the sizes of a MultiDiscrete, whose sum is `outputs`
    about         where it comes from: {scenario, defense, seed, steps, package, ...}, texts and numbers
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from trust_env.agents.wrappers import WRAPPERS, build_wrapper
from trust_env.spaces.observation import KNOWLEDGE, NAMES
from trust_env.spec import parse

FORMAT = 1
ACTIVATIONS = ("tanh", "relu")
MOST_LAYERS, MOST_WIDTH, MOST_TEXT, MOST_FACTS = 16, 65536, 2000, 64
MOST_LOG_STD, MOST_PARAMETER = 20.0, 1000


def check_policy(tensors: Mapping[str, np.ndarray], config: Mapping[str, Any]) -> None:
    """ValueError, naming the key or the tensor, for a policy that does not fit the tables above."""
    _check_config(config)
    normalised = "obs_mean" in tensors
    _check_tensors(tensors, tensor_shapes(config["layers"], config["choices"], normalised))


def _check_config(config: Mapping[str, Any]) -> None:
    for key in config:
        if key not in _CONFIG:
            raise ValueError(f"config: unknown key {shortened(key)}; known: {', '.join(_CONFIG)}")
    for key, (fits, expected) in _CONFIG.items():
        if key not in config:
            raise ValueError(f"config: {key} is missing; expected {expected}")
        if not fits(config[key]):
            raise ValueError(f"config: {key} = {shortened(config[key])}: expected {expected}")
    outputs, choices = config["layers"][-1], config["choices"]
    if choices is not None and sum(choices) != outputs:
        raise ValueError(f"config: choices = {shortened(choices)}: expected sizes that sum to {outputs}")


def tensor_shapes(layers: list[int], choices: list[int] | None, normalised: bool) -> dict[str, tuple[int, ...]]:
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
            raise ValueError(f"unknown tensor {shortened(name)}; expected {', '.join(shapes)}")
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


def _is_whole(value: Any, most: int) -> bool:
    return type(value) is int and 1 <= value <= most


def _are_whole(value: Any, least: int) -> bool:
    fits = isinstance(value, list) and least <= len(value) <= MOST_WIDTH
    return fits and all(_is_whole(entry, MOST_WIDTH) for entry in value)


def _are_layers(value: Any) -> bool:
    return _are_whole(value, 2) and len(value) <= MOST_LAYERS


def _is_wrapper(value: Any) -> bool:
    """Whether it is the name of a built-in wrapper; no file that it might name is ever run."""
    if not isinstance(value, str) or len(value) > MOST_TEXT:
        return False
    try:
        spec = parse(value)
        simple = spec.path is None and all(map(_is_word_or_number, spec.params.values()))
        return simple and spec.name in WRAPPERS and build_wrapper(value) is not None
    except (ValueError, TypeError):
        return False


def _is_word_or_number(value: Any) -> bool:
    """A word, or a number small enough that a wrapper can allocate as much."""
    match value:
        case str():
            return re.fullmatch(r"\w*", value) is not None
        case int():
            return abs(value) <= MOST_PARAMETER
    return value is None or isinstance(value, float)


def _are_fields(value: Any) -> bool:
    return isinstance(value, dict) and all(k in NAMES and _is_whole(v, MOST_WIDTH) for k, v in value.items())


def _are_facts(value: Any) -> bool:
    fits = isinstance(value, dict) and len(value) <= MOST_FACTS
    return fits and all(map(_is_fact, [*value, *value.values()]))


def _is_fact(value: Any) -> bool:
    match value:
        case None | bool():
            return True
        case str():
            return len(value) <= MOST_TEXT
        case int() | float():
            return math.isfinite(value) and abs(value) < 2**63
    return False


_NAMES = ", ".join(WRAPPERS)
# By key: whether a value fits, and what was expected.
_CONFIG: dict[str, tuple[Callable[[Any], bool], str]] = {
    "format": (lambda v: type(v) is int and v == FORMAT, f"{FORMAT}, the only format there is"),
    "wrapper": (_is_wrapper, f"one of the built-in wrappers, {_NAMES}, with parameters that it takes"),
    "knowledge": (lambda v: isinstance(v, str) and v in KNOWLEDGE, f"one of {', '.join(KNOWLEDGE)}"),
    "fields": (_are_fields, "the names of fields of the observation with their numbers of entries"),
    "layers": (_are_layers, f"2 to {MOST_LAYERS} whole numbers of 1 to {MOST_WIDTH}"),
    "activation": (lambda v: isinstance(v, str) and v in ACTIVATIONS, f"one of {', '.join(ACTIVATIONS)}"),
    "choices": (lambda v: v is None or _are_whole(v, 1), "null, or a list of whole numbers of at least 1"),
    "about": (_are_facts, f"a dict of at most {MOST_FACTS} texts and finite numbers"),
}


def shortened(value: Any) -> str:
    """The value as in Python, cut to 80 characters."""
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
