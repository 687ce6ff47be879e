"""What is installed: one package, trust_env, with agents and training in it."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import zipfile
from collections import Counter
from pathlib import Path

import pytest
from paths import ROOT

ROOMS = ("trust_env", "agents", "training")  # in the checkout; installed, the other two are in trust_env
# Imports all but what imports large libraries, and prints the file of each module.
LIST_MODULES = """
import os, pkgutil, sys
sys.path[:0] = sys.argv[1:]
import trust_env
def fail(name): raise
for _, name, _ in pkgutil.walk_packages(trust_env.__path__, "trust_env.", fail):
    if not {"__main__", "examples", "learning", "paper", "speed"} & set(name.split(".")):
        __import__(name)
for name, module in sorted(sys.modules.items()):
    if name.split(".")[0] in ("trust_env", "agents", "training"):
        print(name, os.path.realpath(module.__file__))
"""


def build(kind: str, source: Path, target: Path) -> Path:
    """What the build backend makes of a source tree: a "wheel", an "sdist" or an "editable"."""
    code = f"from hatchling import build; print(build.build_{kind}({str(target)!r}))"
    built = subprocess.run([sys.executable, "-c", code], cwd=source, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    return target / built.stdout.split()[-1]


def checksums(wheel: Path) -> dict[str, int]:
    """Name and checksum of each file of the package itself."""
    with zipfile.ZipFile(wheel) as archive:
        return {i.filename: i.CRC for i in archive.infolist() if i.filename.startswith("trust_env/")}


def modules_of(*path: Path, cwd: Path) -> dict[str, Path]:
    """The file of each module that `LIST_MODULES` imports, with `path` before all else on sys.path."""
    # -P: the current folder is on the path only where `path` names it.
    command = [sys.executable, "-P", "-c", LIST_MODULES, *map(str, path)]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    listed = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True)
    assert listed.returncode == 0, listed.stderr
    return {name: Path(file) for name, file in (line.split(" ", 1) for line in listed.stdout.splitlines())}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build("wheel", ROOT, tmp_path_factory.mktemp("wheel"))


def test_a_wheel_holds_every_file_of_the_package_once_and_no_other_package(wheel):
    files = [path for room in ROOMS for path in (ROOT / room).rglob("*") if path.is_file()]
    names = [str(path.relative_to(ROOT)) for path in files if "__pycache__" not in path.parts]
    expected = [name if name.startswith("trust_env/") else f"trust_env/{name}" for name in names]
    packed = [name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name]
    assert Counter(packed) == Counter(expected)


@pytest.mark.parametrize("suffix", ["py.typed", ".yaml", ".csv", ".safetensors", ".json"])
def test_a_wheel_holds_data_files(wheel, suffix):
    assert any(name.endswith(suffix) for name in checksums(wheel))


def test_an_archive_of_sources_holds_no_links_and_makes_the_same_wheel(wheel, tmp_path):
    archive = build("sdist", ROOT, tmp_path)
    with tarfile.open(archive) as tar:
        assert all(member.isfile() or member.isdir() for member in tar.getmembers())
        tar.extractall(tmp_path / "sources", filter="data")
    (tree,) = (tmp_path / "sources").iterdir()
    assert not (tree / "trust_env" / "agents").exists() and not (tree / "trust_env" / "training").exists()
    assert checksums(build("wheel", tree, tmp_path)) == checksums(wheel)


def test_folders_named_agents_and_training_beside_a_script_change_nothing(wheel, tmp_path):
    site, beside = tmp_path / "site", tmp_path / "beside"
    zipfile.ZipFile(wheel).extractall(site)
    for name in ("agents", "training"):
        (beside / name).mkdir(parents=True)
        (beside / name / "__init__.py").write_text(f"raise ImportError('not the {name} that was meant')")
    modules = modules_of(beside, site, cwd=beside)
    assert {"trust_env.agents.base", "trust_env.training.cli.main"} <= set(modules)
    assert all(name.startswith("trust_env") and file.is_relative_to(site) for name, file in modules.items())


def test_in_the_checkout_every_file_is_one_module():
    modules = modules_of(ROOT, cwd=ROOT)
    assert {"trust_env.agents.base", "trust_env.training.cli.main"} <= set(modules)
    assert all(name.startswith("trust_env") and file.is_relative_to(ROOT) for name, file in modules.items())
    assert not [file for file, count in Counter(modules.values()).items() if count > 1]


def test_an_editable_installation_uses_the_checkout(tmp_path):
    archive = zipfile.ZipFile(build("editable", ROOT, tmp_path))
    (link,) = (name for name in archive.namelist() if ".dist-info/" not in name)
    assert link.endswith(".pth") and archive.read(link).decode().strip() == str(ROOT)
