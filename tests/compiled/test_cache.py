"""Machine code that is kept: loaded where it fits, made anew where it does not."""

from __future__ import annotations

import errno
from pathlib import Path

import numba
import numpy as np
import pytest

from trust_env.compiled.cache import NativeKernel
from trust_env.compiled.jit import BOUNDSCHECK, JIT_OFF
from trust_env.world.fields import ints_at

KEEPS = pytest.mark.skipif(JIT_OFF or BOUNDSCHECK, reason="machine code is kept by the plain compiler only")
COMPILED = "compiled in"


def _add(address, count, summand):
    numbers = ints_at(address, count)
    for i in range(count):
        numbers[i] += summand


def add(kernel: NativeKernel) -> list[int]:
    """What a kernel makes of 1, 2, 3 when it shall add 4."""
    numbers = np.array([1, 2, 3])
    kernel(numbers.ctypes.data, 3, 4)
    return numbers.tolist()


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    return tmp_path


@pytest.mark.core
@pytest.mark.nojit
def test_a_kernel_works_on_addresses(kept):
    assert add(NativeKernel(_add)) == [5, 6, 7]


@KEEPS
def test_the_second_start_loads_what_the_first_has_compiled(kept, capfd):
    first = NativeKernel(_add)
    assert add(first) == add(first) == [5, 6, 7]
    assert capfd.readouterr().err.count(COMPILED) == 1
    assert add(NativeKernel(_add)) == [5, 6, 7]
    assert capfd.readouterr().err == ""
    (file,) = kept.rglob("*_add*")  # nothing unfinished beside it
    assert file.suffix == ".kernel"


@KEEPS
@pytest.mark.parametrize("part", [0.0, 0.01, 0.5, 0.999], ids=str)
def test_a_torn_file_is_made_anew(kept, capfd, part):
    add(NativeKernel(_add))
    (file,) = kept.rglob("*.kernel")
    whole = file.read_bytes()
    file.write_bytes(whole[: int(part * len(whole))])
    capfd.readouterr()
    assert add(NativeKernel(_add)) == [5, 6, 7]
    assert COMPILED in capfd.readouterr().err
    assert add(NativeKernel(_add)) == [5, 6, 7] and COMPILED not in capfd.readouterr().err


@KEEPS
@pytest.mark.parametrize(
    "change", [(b'stamp": "', b'stamp": "0'), (b'outer": [', b'outer": ["no_such_function"')]
)
def test_code_for_other_sources_or_other_libraries_is_not_run(kept, capfd, change):
    add(NativeKernel(_add))
    (file,) = kept.rglob("*.kernel")
    file.write_bytes(file.read_bytes().replace(*change, 1))
    capfd.readouterr()
    assert add(NativeKernel(_add)) == [5, 6, 7]
    assert COMPILED in capfd.readouterr().err


@KEEPS
def test_on_a_full_disk_each_start_compiles(kept, monkeypatch, capfd):
    def write(file: Path, data: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device", str(file))

    monkeypatch.setattr(Path, "write_bytes", write)
    assert [add(NativeKernel(_add)) for _ in range(2)] == [[5, 6, 7]] * 2
    assert capfd.readouterr().err.count(COMPILED) == 2
    assert not list(kept.rglob("*_add*"))
