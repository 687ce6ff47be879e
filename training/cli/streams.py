"""Stdout and stderr on which no command fails: closed, left by their reader, or of an encoding that lacks signs."""

from __future__ import annotations

import codecs
import io
import os
import sys
import unicodedata
from typing import TYPE_CHECKING, TextIO

from trust_env.files import naming

if TYPE_CHECKING:
    from typing_extensions import Buffer

_NEAREST = "trust_env.nearest"  # an error handler: the nearest sign that every encoding has
_SIGNS = {**dict.fromkeys("–—−─━═╌", "-"), **dict.fromkeys("│┃║", "|"), "…": "~", "×": "x", "·": "."}  # fmt: skip
_BOXES = range(0x2500, 0x2580)


def open_streams() -> None:
    """Put streams in the place of `sys.stdout` and `sys.stderr` that can be written to, come what may."""
    while (handle := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass  # else the next file that is opened would be stdout to some library
    os.close(handle)
    codecs.register_error(_NEAREST, _nearest_signs)
    sys.stdout, sys.stderr = _opened(sys.stdout, 1, "stdout"), _opened(sys.stderr, 2, "stderr")


def _opened(stream: TextIO | None, handle: int, name: str) -> TextIO:
    if stream is not None and os.name == "nt":
        return stream  # its console takes no bytes
    encoding = "utf-8" if stream is None else stream.encoding
    lines = name == "stderr" or (stream is not None and stream.isatty())
    return io.TextIOWrapper(io.BufferedWriter(_Output(handle, name)), encoding, _NEAREST, line_buffering=lines)


class _Output(io.FileIO):
    """Bytes for a reader who may leave, as in `trust-env ... | head`: the rest is dropped.

    A full disk is raised, once, where it loses results.
    """

    def __init__(self, handle: int, name: str):
        super().__init__(handle, "w", closefd=False)
        self._label, self._lost = name, name == "stderr"

    def write(self, data: Buffer) -> int:
        try:
            with naming(self._label):
                return super().write(data)
        except BrokenPipeError:
            return memoryview(data).nbytes
        except OSError:
            if self._lost:
                return memoryview(data).nbytes
            self._lost = True
            raise


def _nearest_signs(error: UnicodeError) -> tuple[str, int]:
    """For `codecs`: one sign for each that the encoding lacks, so that tables stay aligned."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(_nearest_sign, error.object[error.start : error.end])), error.end


def _nearest_sign(sign: str) -> str:
    bare = unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode()
    return _SIGNS.get(sign) or ("+" if ord(sign) in _BOXES else bare[:1]) or "?"
