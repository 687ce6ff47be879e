"""Checkpoints: a tree of built-in values and arrays in one file, without pickles. The last two are kept.

A file is a zip archive: `tree.json`, in which every array is a reference, and the arrays as .npy files. The
archive's checksums detect a damaged file. It is written under another name, flushed to the disk and renamed
in one step, so that a complete one exists whenever the program dies.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from trust_env.files import remove_unfinished, write_atomically

KEPT = 2  # checkpoints of a run
_TREE = "tree.json"
_KIND = "__kind__"  # marks values that JSON lacks


class Checkpoints:
    """The checkpoints of a run by step count: `checkpoints/000000051200.zip`."""

    def __init__(self, folder: Path):
        self.folder = folder

    def files(self) -> list[Path]:
        """The complete checkpoint files, the last one first."""
        return sorted(self.folder.glob("[0-9]*.zip"), reverse=True)

    def save(self, steps: int, tree: Any) -> None:
        """Write a checkpoint, then remove those before the last two. OSError: all others stay."""
        self.folder.mkdir(exist_ok=True)
        write_atomically(self.folder / f"{steps:012d}.zip", lambda file: write_tree(file, tree))
        for old in self.files()[KEPT:]:
            old.unlink()
        remove_unfinished(self.folder)

    def load(self, tell: Callable[[str], None]) -> Any | None:
        """The tree of the last checkpoint that can be read; None if there are no checkpoints.

        tell(text) is called for each one that cannot be read; it is renamed. ValueError: none can be read.
        """
        files = self.files()
        for file in files:
            try:
                return read_tree(file)
            except ValueError as fault:
                tell(f"{fault}; the one before is taken")
                file.replace(file.with_suffix(".damaged"))
        if files:
            raise ValueError(f"{self.folder}: none of the {len(files)} checkpoints can be read; nothing to resume")
        return None


def write_tree(file: Path, tree: Any) -> None:
    """Write a tree of dicts, lists, tuples, texts, bytes, numbers, None and arrays; else TypeError."""
    arrays: list[np.ndarray] = []
    text = json.dumps(_packed(tree, arrays))
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr(_TREE, text)
        for i, array in enumerate(arrays):
            data = io.BytesIO()
            np.save(data, array, allow_pickle=False)
            archive.writestr(f"{i}.npy", data.getbuffer())


def read_tree(file: Path) -> Any:
    """The tree that `write_tree` wrote. ValueError: the file is damaged, or is no checkpoint."""
    try:
        with zipfile.ZipFile(file) as archive:
            return _unpacked(json.loads(archive.read(_TREE)), archive)
    except (zipfile.BadZipFile, KeyError, ValueError, EOFError, OSError) as fault:
        raise ValueError(f"{file}: not a complete checkpoint: {fault}") from None


def _packed(value: Any, arrays: list[np.ndarray]) -> Any:
    """The value for JSON; its arrays are appended to `arrays`."""
    match value:
        case None | bool() | str():
            return value
        case np.ndarray() if value.dtype.kind in "biufc":
            arrays.append(value)
            return {_KIND: "array", "index": len(arrays) - 1}
        case bytes():
            return {_KIND: "bytes", "of": _packed(np.frombuffer(value, dtype=np.uint8), arrays)}
        case np.generic() if value.dtype.kind in "biuf":
            return {_KIND: "scalar", "dtype": value.dtype.str, "value": value.item()}
        case int() | float():
            return value
        case list():
            return [_packed(item, arrays) for item in value]
        case tuple():
            return {_KIND: "tuple", "items": [_packed(item, arrays) for item in value]}
        case dict() if all(type(key) is str for key in value) and _KIND not in value:
            return {key: _packed(item, arrays) for key, item in value.items()}
        case dict():
            items = [[_packed(k, arrays), _packed(v, arrays)] for k, v in value.items()]
            return {_KIND: "dict", "items": items}
    raise TypeError(f"a checkpoint holds built-in values and arrays of numbers; got {type(value).__name__}")


def _unpacked(value: Any, archive: zipfile.ZipFile) -> Any:
    """The value that `_packed` was given."""
    if isinstance(value, list):
        return [_unpacked(item, archive) for item in value]
    if not isinstance(value, dict):
        return value
    match value.get(_KIND):
        case "array":
            return np.load(io.BytesIO(archive.read(f"{value['index']}.npy")), allow_pickle=False)
        case "scalar":
            return np.dtype(value["dtype"]).type(value["value"])
        case "bytes":
            return _unpacked(value["of"], archive).tobytes()
        case "tuple":
            return tuple(_unpacked(item, archive) for item in value["items"])
        case "dict":
            return {_unpacked(k, archive): _unpacked(v, archive) for k, v in value["items"]}
    return {key: _unpacked(item, archive) for key, item in value.items()}
