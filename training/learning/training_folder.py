"""The folder of a training run: all that repeating it, resuming it and playing its policy needs.

config.yaml          everything that was configured
scenario.yaml        the scenario, as it was when the run began
run.json             versions, machine, command lines, files of the user's by their digest
checkpoints/         the last two, see `checkpoint`
policy.safetensors   the policy of the last checkpoint, which `evaluate --attack` plays
progress.csv, evaluations.csv, tensorboard/
"""

from __future__ import annotations

import json
import platform
import shlex
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import trust_env
from trust_env.agents import parse_policy
from trust_env.files import expanded, folder_contents, remove_unfinished, require_empty, write_atomically
from trust_env.scenario import Scenario, load_scenario
from trust_env.spec import parse
from trust_env.training.evaluation.configuration import digest, files_of
from trust_env.training.learning.checkpoint import Checkpoints
from trust_env.training.learning.configuration import Configuration, load_configuration

CONFIG, SCENARIO, RUN = "config.yaml", "scenario.yaml", "run.json"
_PACKAGES = ("torch", "stable-baselines3", "numpy", "numba", "gymnasium", "pettingzoo", "safetensors")


class TrainingFolder:
    """The files of a run. config.yaml is written last: where it is, the run can begin."""

    def __init__(self, path: Path):
        self.path = path
        self.checkpoints = Checkpoints(path / "checkpoints")

    def create(self, config: Configuration, scenario: Scenario) -> None:
        """Write what a run begins with. ValueError: the folder is not empty; OSError: it cannot be written."""
        self._require_empty()
        self._write(SCENARIO, scenario.to_yaml())
        self._write_run([], _digests(config, scenario))
        self._write(CONFIG, config.to_yaml())

    @classmethod
    def open(cls, path: str | Path) -> TrainingFolder:
        """ValueError: there is no training run in it."""
        folder = cls(expanded(path))
        if not (folder.path / CONFIG).is_file() or not (folder.path / RUN).is_file():
            found = "there is no such folder" if not folder.path.is_dir() else f"there is no {CONFIG} in it"
            raise ValueError(f"{path}: {found}; expected the folder of a training run, made by train --out")
        return folder

    def _require_empty(self) -> None:
        if CONFIG in folder_contents(self.path):
            raise ValueError(
                f"{self.path}: there is a training run in this folder, and nothing is overwritten; "
                f"expected a new or empty folder, or --resume {self.path} to continue the run"
            )
        # What is ignored is left behind by a run that died while it began.
        require_empty(self.path, ignored={SCENARIO, RUN})

    def configuration(self) -> Configuration:
        return load_configuration(self.path / CONFIG)

    def scenario(self) -> Scenario:
        return load_scenario(self.path / SCENARIO)

    def begin(self, config: Configuration, scenario: Scenario) -> None:
        """Record that a session begins. ValueError: a file of the user's has changed."""
        remove_unfinished(self.path)
        found = json.loads((self.path / RUN).read_text(encoding="utf-8"))
        here = _digests(config, scenario)
        for file, before in found["files"].items():
            if here.get(file) != before:
                raise ValueError(f"{file}: it has changed since the run in {self.path} began; expected it as it was")
        self._write_run([*found["sessions"], _session()], here)

    def _write_run(self, sessions: list[dict[str, Any]], files: Mapping[str, str]) -> None:
        self._write(RUN, json.dumps({"files": files, "sessions": sessions}, indent=2) + "\n")

    def _write(self, name: str, text: str) -> None:
        write_atomically(self.path / name, lambda file: file.write_text(text, encoding="utf-8"))


def _session() -> dict[str, Any]:
    """Time, command, machine and package versions of a session."""
    return {
        "began": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": shlex.join(sys.argv),
        "platform": platform.platform(),
        "processor": platform.processor() or platform.machine(),
        "python": platform.python_version(),
        "packages": {"trust-env": trust_env.__version__, **{name: version(name) for name in _PACKAGES}},
    }


def _digests(config: Configuration, scenario: Scenario) -> dict[str, str]:
    """Digests of the user's own files, the weights and the data that the run depends on."""
    policies = [parse_policy(text) for text in config.others.values()]
    files = dict(pair for spec in [parse(config.defense), *policies] for pair in files_of(spec))
    data = scenario.targets.data
    return {name: digest(file) for name, file in (files | ({data: data} if data else {})).items()}
