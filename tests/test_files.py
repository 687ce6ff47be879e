"""Files that are written whole or not at all, and folders in which nothing is overwritten."""

import errno
import os
import stat
import subprocess
import sys

import pytest
from paths import ROOT

from trust_env import files
from trust_env.files import expanded, folder_contents, locked, remove_unfinished, require_empty, write_atomically


@pytest.mark.parametrize("fault", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, fault):
    file = tmp_path / "results.json"
    file.write_text("old")

    def fails_halfway(path):
        path.write_text("ne")
        raise fault

    with pytest.raises((OSError, KeyboardInterrupt)) as raised:
        write_atomically(file, fails_halfway)
    assert isinstance(fault, KeyboardInterrupt) or raised.value.filename == str(file)
    assert file.read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["results.json"]


def test_a_file_is_on_the_disk_before_it_replaces_the_old_one(tmp_path, monkeypatch):
    calls, replace = [], os.replace
    monkeypatch.setattr(files, "sync", lambda path: calls.append(path.name))
    monkeypatch.setattr(os, "replace", lambda *paths: (calls.append("replace"), replace(*paths)))
    write_atomically(tmp_path / "a", lambda path: path.write_text("new"))
    assert calls == ["a", "replace", tmp_path.name]
    assert (tmp_path / "a").read_text() == "new"


@pytest.mark.skipif(os.name == "nt", reason="permissions are those of POSIX")
def test_a_file_has_the_permissions_of_any_new_file(tmp_path):
    (tmp_path / "plain").write_text("")
    write_atomically(tmp_path / "a", lambda path: path.write_text(""))
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("plain", "a")]
    assert modes[0] == modes[1]


def test_what_a_killed_program_leaves_behind_is_ignored_and_removed(tmp_path):
    code = (
        "import os, sys; from pathlib import Path; from trust_env.files import write_atomically\n"
        "write_atomically(Path(sys.argv[1]) / 'a', lambda path: (path.write_text('half'), os._exit(9)))"
    )
    killed = subprocess.run([sys.executable, "-c", code, str(tmp_path)], cwd=ROOT)
    assert killed.returncode == 9
    assert len(list(tmp_path.iterdir())) == 1
    assert folder_contents(tmp_path) == []
    require_empty(tmp_path)
    remove_unfinished(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_not_empty_is_refused_by_what_it_holds(tmp_path):
    require_empty(tmp_path / "new" / "folder")
    assert (tmp_path / "new" / "folder").is_dir()
    (tmp_path / "thesis.tex").write_text("mine")
    require_empty(tmp_path, ignored={"thesis.tex", "new"})
    with pytest.raises(ValueError, match=r"holds thesis\.tex.* nothing is overwritten.* folder, or --resume"):
        require_empty(tmp_path, "--resume", ignored={"new"})
    with pytest.raises(ValueError, match=r"thesis\.tex: expected a folder, this is a file"):
        require_empty(tmp_path / "thesis.tex")


def test_a_home_that_is_nobodys_is_a_folder_like_any_other(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    assert expanded("~/runs") == tmp_path / "runs"
    assert str(expanded("~nobody_of_that_name/runs")) == "~nobody_of_that_name/runs"


needs_locks = pytest.mark.skipif(files.fcntl is None, reason="this system has no such locks")
LOCKS = (
    "import sys; from pathlib import Path; from trust_env.files import locked\n"
    "with locked(Path(sys.argv[1])): print('locked', flush=True), sys.stdin.read()"
)


@needs_locks
def test_a_folder_is_locked_until_its_process_ends_or_is_killed(tmp_path):
    folder = tmp_path / "new" / "folder"
    command = [sys.executable, "-c", LOCKS, str(folder)]
    other = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert other.stdout is not None and other.stdout.readline() == "locked\n"
    with pytest.raises(ValueError, match=r"folder: another process is at work in this folder"), locked(folder):
        pass
    other.kill()
    other.wait()
    with locked(folder):
        assert folder_contents(folder) == []
    assert list(folder.iterdir()) == []


@needs_locks
def test_a_lock_that_its_owner_removes_is_not_taken_for_one(tmp_path, monkeypatch):
    """Opened while it was another's, locked when it is nobody's: whoever comes next would make a second file."""
    flock, handles = files.fcntl.flock, []

    def owner_ends_first(handle, operation):
        if not handles:
            next(tmp_path.iterdir()).unlink()
        handles.append(handle)
        flock(handle, operation)

    monkeypatch.setattr(files.fcntl, "flock", owner_ends_first)
    with locked(tmp_path), pytest.raises(ValueError, match="another process"), locked(tmp_path):
        pass
    assert len(handles) == 3


@needs_locks
def test_a_file_system_without_locks_is_used_without(tmp_path, monkeypatch):
    def unknown(handle, operation):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(files.fcntl, "flock", unknown)
    with locked(tmp_path):
        assert folder_contents(tmp_path) == []
    assert list(tmp_path.iterdir()) == []
