"""Files that are complete or not there at all; folders in which nothing is overwritten, and one process works."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

try:
    import fcntl
except ImportError:
    fcntl: Any = None  # Windows has no such locks

_UNFINISHED = ".unfinished"  # how the name of a folder ends that holds a file while it is being written
_LOCK = ".trust_env.lock"
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP}  # on some file systems of networks


def expanded(path: str | Path) -> Path:
    """The path, with ~ and ~name as the folders that they stand for; as it is where they stand for none."""
    return Path(os.path.expanduser(path))


def write_atomically(file: Path, write: Callable[[Path], Any]) -> None:
    """Make `file` what `write(path)` writes to another path, whole or not at all, whenever the program dies.

    What stood there before stays until the new file is complete and on the disk.
    OSError: it could not be written; nothing has changed then.
    """
    # A file made in a temporary folder has the permissions of any new file, a temporary file has not.
    options = {"prefix": f"{file.name}.", "suffix": _UNFINISHED, "dir": file.parent}
    with naming(file), TemporaryDirectory(**options) as folder:
        temporary = Path(folder) / file.name
        write(temporary)
        sync(temporary)
        os.replace(temporary, file)
    sync(file.parent)


@contextlib.contextmanager
def naming(file: Path | str) -> Iterator[None]:
    """Every OSError of the block names this file."""
    try:
        yield
    except OSError as fault:
        text = str(fault) if fault.errno is None else os.strerror(fault.errno)
        raise OSError(fault.errno, text, str(file)) from None


def sync(path: Path) -> None:
    """Wait until a file, or the list of a folder's files, is on the disk."""
    if path.is_dir() and os.name == "nt":
        return  # folders cannot be opened there
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        with naming(path):
            os.fsync(handle)
    finally:
        os.close(handle)


def remove_unfinished(folder: Path) -> None:
    """Remove what a program left behind that died while it wrote. Nobody else may be writing there."""
    for leftover in folder.glob(f"*{_UNFINISHED}"):
        shutil.rmtree(leftover, ignore_errors=True)


def folder_contents(folder: Path) -> list[str]:
    """The sorted names of what is in a folder, which is made if need be; unfinished files and locks do not count.

    ValueError: it is a file; OSError: it cannot be made.
    """
    _make_folder(folder)
    names = (path.name for path in folder.iterdir())
    return sorted(name for name in names if name != _LOCK and not name.endswith(_UNFINISHED))


def _make_folder(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: expected a folder, this is a file")
    folder.mkdir(parents=True, exist_ok=True)


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


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """While the block runs, nobody else can lock the folder, which is made if need be.

    The system ends the lock with the process, however that ends. ValueError: another process has locked it.
    """
    _make_folder(folder)
    if fcntl is None:
        yield
        return
    handle = _lock(folder / _LOCK)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            (folder / _LOCK).unlink()
        os.close(handle)


def _lock(file: Path) -> int:
    """A handle that holds the lock of a file, which is made if need be."""
    while True:
        handle = os.open(file, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(handle)
            text = "another process is at work in this folder; expected to be the only one, or another folder"
            raise ValueError(f"{file.parent}: {text}") from None
        except OSError as fault:
            if fault.errno not in _NO_LOCKS:
                raise
        if _is_file(handle, file):
            return handle
        os.close(handle)  # who held the lock has removed the file since it was opened here


def _is_file(handle: int, file: Path) -> bool:
    """Whether a path still names the file that was opened."""
    try:
        return os.path.samestat(os.fstat(handle), file.stat())
    except FileNotFoundError:
        return False
