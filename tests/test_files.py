"""Files that are written whole or not at all, and folders in which nothing is overwritten."""

import errno
import os
import stat
import subprocess
import sys

import pytest
from paths import ROOT

from trust_env import files
from trust_env.files import folder_contents, remove_unfinished, require_empty, write_atomically


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
