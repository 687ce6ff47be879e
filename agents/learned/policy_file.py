"""The file of a learned policy: tensors and a plain config in one safetensors file. No code, no pickle.

Reading a file runs no code from it and builds only arrays and one of the built-in wrappers, so that files of
strangers are safe to read. All of it is checked against the tables of `policy_checks`; what does not fit
raises ValueError.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import safetensors
import safetensors.numpy

from trust_env.agents.learned.policy_checks import FORMAT, check_policy, shortened
from trust_env.files import expanded, write_atomically

FILE = "policy.safetensors"  # in a run folder
MOST_BYTES, MOST_HEADER = 64 << 20, 1 << 20
_KEY = "trust_env"
_FOREIGN = {  # what a file begins with, and what it then is
    b"PK\x03\x04": "a zip archive, as Stable-Baselines3 and PyTorch write them",
    b"\x80": "a pickle",
}

Tensors = dict[str, np.ndarray]


def policy_file(path: str | Path) -> Path:
    """The policy file that a path names: itself, or the one in a run folder. ValueError: there is none."""
    given = expanded(path)
    if given.is_dir() and not (given / FILE).is_file():
        raise ValueError(f"{given}: there is no {FILE} in this folder; expected the folder of a training run")
    file = given / FILE if given.is_dir() else given
    if not file.is_file():
        expected = f"expected a {FILE}, or the folder of a training run"
        raise ValueError(f"{given}: there is no such file; {expected}")
    return file


def save_policy(path: str | Path, tensors: Mapping[str, np.ndarray], config: Mapping[str, Any]) -> None:
    """Write a policy file (of a folder: its policy.safetensors), complete or not at all.

    tensors, config: as in `policy_checks`; `format` may be left out. Raises ValueError for what does not fit.
    """
    config = json.loads(json.dumps({"format": FORMAT, **config}))
    arrays = {name: np.ascontiguousarray(tensors[name]) for name in sorted(tensors)}
    check_policy(arrays, config)
    data = safetensors.numpy.save(arrays, {_KEY: json.dumps(config)})
    file = expanded(path)
    file = file / FILE if file.is_dir() else file
    write_atomically(file, lambda path: path.write_bytes(data))


def load_policy(path: str | Path) -> tuple[Tensors, dict[str, Any]]:
    """Tensors and config of a policy file, or of a run folder.

    Raises ValueError, naming the file and what was expected, for anything that does not fit `policy_checks`.
    """
    file = policy_file(path)
    with open(file, "rb") as opened:
        data = opened.read(MOST_BYTES + 1)
    try:
        config = _config(data)
        tensors = safetensors.numpy.load(data)
        check_policy(tensors, config)
    except (ValueError, safetensors.SafetensorError) as fault:
        raise ValueError(f"{file}: not the file of a learned policy: {fault}") from None
    return tensors, config


def _config(data: bytes) -> dict[str, Any]:
    """The config in the file's header; ValueError for a header that safetensors had better not read."""
    header = _header(data)
    metadata = header.pop("__metadata__", None)
    if not isinstance(metadata, dict) or not isinstance(metadata.get(_KEY), str):
        raise ValueError(f"its metadata has no text {_KEY!r}; expected the config of a policy there")
    for name, entry in header.items():
        dtype = entry.get("dtype") if isinstance(entry, dict) else None
        if dtype not in ("F32", "F64"):
            raise ValueError(f"tensor {shortened(name)} has dtype {shortened(dtype)}; expected F32")
    return _json(_KEY, metadata[_KEY].encode())


def _header(data: bytes) -> dict[str, Any]:
    """The JSON that a safetensors file begins with: its length in 8 bytes, then its text."""
    size = int.from_bytes(data[:8], "little")
    for start, what in _FOREIGN.items():
        if data.startswith(start) and size > MOST_HEADER:
            raise ValueError(f"it is {what}; expected a safetensors file")
    if not 8 < len(data) <= MOST_BYTES:
        raise ValueError(f"it has {len(data)} bytes; expected a safetensors file of at most {MOST_BYTES}")
    if size > min(MOST_HEADER, len(data) - 8):
        limit = f"at most {MOST_HEADER}, and no more than the file's {len(data)}"
        raise ValueError(f"its header has {size} bytes; expected {limit}: a safetensors file that is complete")
    return _json("header", data[8 : 8 + size])


def _json(what: str, text: bytes) -> dict[str, Any]:
    try:
        found = json.loads(text.decode())
    except (ValueError, RecursionError) as fault:
        raise ValueError(f"{what}: expected JSON; {fault}") from None
    if not isinstance(found, dict):
        raise ValueError(f"{what} = {shortened(found)}: expected a dict")
    return found
