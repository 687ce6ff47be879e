"""A finished training run that all tests share, and a copy of it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from training_runs import train


@pytest.fixture(scope="session")
def run(tmp_path_factory):
    """An uninterrupted run."""
    return train(out=tmp_path_factory.mktemp("train") / "run")


@pytest.fixture
def copy(run, tmp_path) -> Path:
    """A finished run that may be spoilt."""
    return shutil.copytree(run.folder, tmp_path / "copy")
