"""Files that are complete or not there at all, and folders in which nothing is overwritten."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Collection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

_UNFINISHED = ".unfinished"  # how the name of a folder ends that holds a file while it is being written


def write_atomically(file: Path, write: Callable[[Path], Any]) -> None:
    """Make `file` what `write(path)` writes to another path, whole or not at all, whenever the program dies.

    What stood there before stays until the new file is complete and on the disk.
    OSError: it could not be written; nothing has changed then.
    """
    try:
        # A file made in a temporary folder has the permissions of any new file, a temporary file has not.
        with TemporaryDirectory(prefix=f"{file.name}.", suffix=_UNFINISHED, dir=file.parent) as folder:
            temporary = Path(folder) / file.name
            write(temporary)
            sync(temporary)
            os.replace(temporary, file)
        sync(file.parent)
    except OSError as fault:
        raise OSError(fault.errno, fault.strerror or str(fault), str(file)) from None


def sync(path: Path) -> None:
    """Wait until a file, or the list of a folder's files, is on the disk."""
    if path.is_dir() and os.name == "nt":
        return  # folders cannot be opened there
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def remove_unfinished(folder: Path) -> None:
    """Remove what a program left behind that died while it wrote. Nobody else may be writing there."""
    for leftover in folder.glob(f"*{_UNFINISHED}"):
        shutil.rmtree(leftover, ignore_errors=True)


def folder_contents(folder: Path) -> list[str]:
    """The sorted names of what is in a folder, which is made if need be; unfinished files do not count.

    ValueError: it is a file; OSError: it cannot be made.
    """
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: expected a folder, this is a file")
    folder.mkdir(parents=True, exist_ok=True)
    return sorted(path.name for path in folder.iterdir() if not path.name.endswith(_UNFINISHED))


def require_empty(folder: Path, otherwise: str = "", ignored: Collection[str] = ()) -> None:
    """ValueError where a folder holds anything but the ignored names, as nothing is ever overwritten.

    The folder is made if need be. otherwise: what else than an empty folder is expected, for the message.
    """
    found = [name for name in folder_contents(folder) if name not in ignored]
    if found:
        raise ValueError(
            f"{folder}: the folder is not empty (it holds {found[0]}) and nothing is overwritten; "
            f"expected a new or empty folder{otherwise and f', or {otherwise}'}"
        )
