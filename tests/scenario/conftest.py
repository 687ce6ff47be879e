"""What the tests of scenarios share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from trust_env.scenario import ScenarioError, load_scenario


@pytest.fixture
def error_of() -> Callable[..., str]:
    """The text of the error that loading a source with overrides raises."""

    def error_of(source: Any = "patrol", /, **overrides: Any) -> str:
        with pytest.raises(ScenarioError) as caught:
            load_scenario(source, **overrides)
        return str(caught.value)

    return error_of


@pytest.fixture
def yaml_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    """Write a YAML file into the working directory; its name."""
    monkeypatch.chdir(tmp_path)

    def write(text: str, name: str = "my.yaml") -> str:
        (tmp_path / name).write_text(text)
        return name

    return write
