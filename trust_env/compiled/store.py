"""Where compiled code is kept between starts.

What lies there is run, so that nothing is read but what this user has written and nobody else can change: the
folder and the file belong to the user, and neither group nor others may write to them. A digest over all of
a file tells one that is damaged. Whatever does not fit is as good as absent.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
from contextlib import suppress
from pathlib import Path

import platformdirs
from numba.core import config

_DIGEST = 32  # bytes, SHA-256, before the content
_KEPT = 8  # files of a name: for other processors, other versions


def folder() -> Path | None:
    """The folder of this user's compiled code, below NUMBA_CACHE_DIR where that is set; None where there is none
    that nobody else can write to.
    """
    above = getattr(config, "CACHE_DIR", "")
    path = Path(above) / "trust-env" if above else platformdirs.user_cache_path("trust-env") / "compiled"
    with suppress(OSError):
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        if _is_private(os.stat(path, follow_symlinks=False)) and os.access(path, os.W_OK):
            return path
    return None


def load(name: str, key: str) -> bytes | None:
    """What `save` has kept under a name and a key; None where there is nothing, or nothing to rely on."""
    home = folder()
    if home is None:
        return None
    with suppress(OSError), open(_open_own(home / _file(name, key)), "rb") as file:
        if _is_private(os.fstat(file.fileno())):
            data = file.read()
            digest, content = data[:_DIGEST], data[_DIGEST:]
            if digest == _digest(name, key, content):
                return content
    return None


def save(name: str, key: str, content: bytes) -> None:
    """Keep content, whole or not at all; without a place to keep it nothing happens."""
    home = folder()
    if home is None:
        return
    unfinished = ""
    try:
        descriptor, unfinished = tempfile.mkstemp(dir=home)
        with open(descriptor, "wb") as file:
            file.write(_digest(name, key, content) + content)
        os.replace(unfinished, home / _file(name, key))
    except OSError:
        with suppress(OSError):
            os.unlink(unfinished)
    with suppress(OSError):
        _remove_old(home, name)


def _file(name: str, key: str) -> str:
    return f"{name}-{key[:24]}.code"


def _digest(name: str, key: str, content: bytes) -> bytes:
    return hashlib.sha256(f"{name}\n{key}\n".encode() + content).digest()


def _open_own(path: Path) -> int:
    return os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0))


def _is_private(found: os.stat_result) -> bool:
    """Whether it belongs to this user and nobody else may write to it; Windows keeps that in its profiles."""
    if not hasattr(os, "geteuid"):
        return True
    return found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _remove_old(home: Path, name: str) -> None:
    """Of the files of a name only the last used stay, and nothing that a killed process has left unfinished."""
    files = sorted(home.glob(f"{name}-*.code"), key=lambda file: file.stat().st_mtime)
    for file in files[:-_KEPT]:
        file.unlink(missing_ok=True)
