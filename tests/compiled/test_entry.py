"""Machine code that is kept: loaded where it fits, made anew where it does not, and nobody else's is run."""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from trust_env.compiled import entry as entries
from trust_env.compiled import kernels, mode, store
from trust_env.compiled.entry import Entry
from trust_env.compiled.kernels import kernel
from trust_env.compiled.key import key_of_code
from trust_env.compiled.structs import ints_at

KEEPS = pytest.mark.skipif(
    mode.INTERPRETED or mode.CHECKED or mode.PLAIN, reason="machine code is kept by the plain compiler only"
)
COMPILED = "compiled in"
FACTOR = 1


@kernel
def scale(number):
    return FACTOR * number


def _add(address, count, summand):
    numbers = ints_at(address, count)
    for i in range(count):
        numbers[i] += scale(summand)


def new_entry() -> Entry:
    return Entry(_add, slow=True)


def add(entry: Entry) -> list[int]:
    """What an entry makes of 1, 2, 3 when it shall add 4."""
    numbers = np.array([1, 2, 3])
    entry(numbers.ctypes.data, 3, 4)
    return numbers.tolist()


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    return tmp_path


def kept_file(kept: Path) -> Path:
    (file,) = kept.rglob("*.code")
    return file


@pytest.mark.core
@pytest.mark.nojit
def test_an_entry_works_on_addresses(kept):
    assert add(new_entry()) == [5, 6, 7]


@KEEPS
def test_the_second_start_loads_what_the_first_has_compiled(kept, capfd):
    first = new_entry()
    assert add(first) == add(first) == [5, 6, 7]
    assert capfd.readouterr().err.count(COMPILED) == 1
    assert add(new_entry()) == [5, 6, 7]
    assert capfd.readouterr().err == ""
    assert [file.name for file in kept_file(kept).parent.iterdir()] == [kept_file(kept).name]  # nothing unfinished


@KEEPS
@pytest.mark.parametrize("part", [0.0, 0.01, 0.5, 0.999], ids=str)
def test_a_torn_file_is_made_anew(kept, capfd, part):
    add(new_entry())
    file = kept_file(kept)
    whole = file.read_bytes()
    file.write_bytes(whole[: int(part * len(whole))])
    capfd.readouterr()
    assert add(new_entry()) == [5, 6, 7]
    assert COMPILED in capfd.readouterr().err
    assert add(new_entry()) == [5, 6, 7] and COMPILED not in capfd.readouterr().err


@KEEPS
def test_one_changed_byte_anywhere_makes_a_file_as_good_as_absent(kept):
    entry = new_entry()
    add(entry)
    file, name = kept_file(kept), "trust_env.x"
    key = key_of_code(_add, *entries._target())
    whole = bytearray(file.read_bytes())
    rng = np.random.default_rng(0)
    name = file.name.split("-")[0]
    assert store.load(name, key) is not None
    for place in (0, 31, 32, 40, len(whole) - 1, *rng.integers(0, len(whole), 200)):
        damaged = whole.copy()
        damaged[place] ^= 1 << int(rng.integers(8))
        file.write_bytes(damaged)
        assert store.load(name, key) is None
    file.write_bytes(whole)
    assert store.load(name, key) is not None


@KEEPS
@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="owners and modes are those of POSIX")
@pytest.mark.parametrize("writable", [stat.S_IWGRP, stat.S_IWOTH])
@pytest.mark.parametrize("what", ["file", "folder"])
def test_what_others_can_write_to_is_not_run(kept, capfd, what, writable):
    add(new_entry())
    file = kept_file(kept)
    path = file if what == "file" else file.parent
    path.chmod(path.stat().st_mode | writable)
    capfd.readouterr()
    assert add(new_entry()) == [5, 6, 7]
    assert COMPILED in capfd.readouterr().err


@KEEPS
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can give files away")
@pytest.mark.parametrize("what", ["file", "folder"])
def test_what_belongs_to_others_is_not_run(kept, capfd, what):
    add(new_entry())
    file = kept_file(kept)
    os.chown(file if what == "file" else file.parent, 12345, -1)
    capfd.readouterr()
    assert add(new_entry()) == [5, 6, 7]
    assert COMPILED in capfd.readouterr().err


@KEEPS
def test_a_link_to_compiled_code_is_not_followed(kept, capfd, tmp_path):
    add(new_entry())
    file = kept_file(kept)
    file.rename(tmp_path / "elsewhere")
    file.symlink_to(tmp_path / "elsewhere")
    capfd.readouterr()
    assert add(new_entry()) == [5, 6, 7]
    assert COMPILED in capfd.readouterr().err


@KEEPS
def test_code_that_calls_what_is_not_there_is_made_anew(kept, capfd):
    add(new_entry())
    name, key = kept_file(kept).name.split("-")[0], key_of_code(_add, *entries._target())
    content = store.load(name, key)
    assert content is not None
    store.save(name, key, content.replace(b'outer": [', b'outer": ["no_such_function", ', 1).replace(b", ]", b"]", 1))
    capfd.readouterr()
    assert add(new_entry()) == [5, 6, 7]
    assert COMPILED in capfd.readouterr().err


@KEEPS
def test_on_a_full_disk_each_start_compiles(kept, monkeypatch, capfd):
    def full(*_: Any, **__: Any) -> Any:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(tempfile, "mkstemp", full)
    assert [add(new_entry()) for _ in range(2)] == [[5, 6, 7]] * 2
    assert capfd.readouterr().err.count(COMPILED) == 2
    assert not list(kept.rglob("*.code"))


@KEEPS
def test_without_a_private_folder_nobody_is_told_that_it_happens_once(kept, monkeypatch, capfd):
    monkeypatch.setattr(store, "folder", lambda: None)
    assert add(new_entry()) == [5, 6, 7]
    told = capfd.readouterr().err
    assert "at every start, as there is no private folder" in told and "once" not in told


@KEEPS
def test_only_the_last_used_files_of_a_name_stay(kept):
    for number in range(20):
        store.save("some", f"{number:064}"[::-1], b"code")
    assert len(list(kept.rglob("some-*.code"))) == store._KEPT


@KEEPS
def test_the_key_holds_the_processor_that_is_compiled_for(kept, monkeypatch):
    host = key_of_code(_add, *entries._target())
    monkeypatch.setattr(numba.config, "CPU_NAME", "generic", raising=False)
    assert entries._target() == ("generic", "")
    assert key_of_code(_add, *entries._target()) != host
    assert add(new_entry()) == [5, 6, 7]


@pytest.mark.nojit
def test_the_key_follows_code_constants_and_fields(monkeypatch):
    key = key_of_code(_add)
    assert key_of_code(_add) == key
    monkeypatch.setitem(globals(), "FACTOR", 2)  # a constant of a kernel that the entry calls
    assert key_of_code(_add) != key
    monkeypatch.undo()
    monkeypatch.setattr("trust_env.compiled.key.declarations", lambda: "other fields")
    assert key_of_code(_add) != key


@pytest.mark.nojit
def test_a_kernel_may_not_read_what_the_key_cannot_follow(monkeypatch):
    monkeypatch.setitem(globals(), "FACTOR", [1])
    with pytest.raises(TypeError, match=r"scale reads FACTOR, of <class 'list'>: no constant"):
        key_of_code(_add)


@pytest.mark.skipif(mode.INTERPRETED, reason="needs the compiler")
def test_on_an_unknown_numba_plain_njit_gives_the_same_and_says_so(kept, monkeypatch, capfd):
    for module in (kernels, entries):
        monkeypatch.setattr(module, "PLAIN", True)
    monkeypatch.setattr(mode, "KNOWN", False)
    plain: Any = kernel(lambda number: FACTOR * number)
    monkeypatch.setitem(globals(), "scale", plain)
    assert add(new_entry()) == [5, 6, 7]
    told = capfd.readouterr().err
    assert told.count("is none of those known here (0.62 to 0.68)") == 1
    assert not list(kept.rglob("*.code"))
