"""Which episode is replayed: a row of a run, or one that is described."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trust_env.agents import build_policy, parse_policy
from trust_env.defenses import build_defense
from trust_env.files import expanded
from trust_env.metrics import METRICS
from trust_env.parallel import TrustEnv
from trust_env.scenario import Scenario, load_scenario
from trust_env.spec import parse
from trust_env.training.evaluation.configuration import digest, files_of, is_code, named_specs
from trust_env.training.evaluation.run_folder import ROWS, read_run


@dataclass(frozen=True)
class Episode:
    """Episode 0 of a world of a seed, and who plays it.

    attack, defense: their names; policy, judge: a name that gives them, or objects. metrics: those of the row that it
    stands in, None where undefined; empty: it stands in none.
    """

    scenario: Scenario
    attack: str
    defense: str
    policy: Any
    judge: Any
    seed: int
    world: int
    frames: int
    metrics: Mapping[str, float | None]


class Run:
    """The rows of an evaluation's folder, or of that of `exploit`, which holds one.

    data: the recording that it was played with, of which a run keeps a digest only. Raises ValueError for a folder
    without results, results of another version of the environment, and files that have changed since.
    """

    def __init__(self, folder: str | Path, data: str | Path | None = None):
        path = expanded(folder)
        self.path = path / "evaluation" if (path / "evaluation" / ROWS).is_file() else path
        if not (self.path / ROWS).is_file():
            raise ValueError(f"{folder}: there is no {ROWS} in it; expected a folder made by evaluate --out")
        self.table, self.configuration, _ = read_run(self.path)
        version = TrustEnv.metadata["name"]
        if self.configuration["version"] != version:
            raise ValueError(f"{self.path}: played by {self.configuration['version']}, which {version} cannot repeat")
        self.scenario = self._scenario(data)

    def _scenario(self, data: str | Path | None) -> Scenario:
        fields, known = self.configuration["scenario"], self.configuration["files"].get("targets.data")
        if known is not None and data is None:
            raise ValueError(f"{self.path}: it was played with recorded trajectories; expected them as --data FILE")
        if data is not None:
            self._require_unchanged({"targets.data": data})
            fields = {**fields, "targets": {**fields["targets"], "data": str(expanded(data))}}
        return load_scenario(fields)

    def _require_unchanged(self, files: Mapping[str, str | Path]) -> None:
        for name, file in files.items():
            if self.configuration["files"].get(name) != digest(file):
                raise ValueError(f"{file}: not as it was when {self.path} was played; expected the file of then")

    def episode(self, row: int, attack: Any = None, defense: Any = None) -> Episode:
        """The episode of a row of results.parquet, counted from 0.

        attack, defense: those of the row again, where they are code or objects of the user's own, as a run holds names
        only and no name in a file makes anything be imported. ValueError: no such row, or another attack or defense.
        """
        if isinstance(row, bool) or not isinstance(row, int) or not 0 <= row < self.table.num_rows:
            raise ValueError(f"row = {row!r}: expected a whole number from 0 to {self.table.num_rows - 1}")
        found = self.table.slice(row, 1).to_pylist()[0]
        policy = self._player("attack", found["attack"], attack)
        judge = self._player("defense", found["defense"], defense)
        return Episode(
            self.scenario, found["attack"], found["defense"], policy, judge, found["seed"], found["world"],
            self.configuration["horizon"], {name: found[name] for name in METRICS},
        )  # fmt: skip

    def row_of(self, attack: str, defense: str, world: int) -> int | None:
        """The row of a cell's episode; None: the run has no such cell."""
        columns = (self.table[name].to_pylist() for name in ("attack", "defense", "world"))
        return next((row for row, key in enumerate(zip(*columns)) if key == (attack, defense, world)), None)

    def _player(self, kind: str, name: str, given: Any) -> Any:
        """What plays: by its name, or as given where the name alone does not give it."""
        if given is not None and not isinstance(given, str):
            return given
        build = build_policy if kind == "attack" else build_defense
        if given is not None and (other := named_specs(kind, [given], build)[0].name) != name:
            raise ValueError(f"{kind} = {other}: the row says {name}; expected that, or none")
        try:
            spec = parse_policy(name) if kind == "attack" else parse(name)
            files, code = dict(files_of(spec)), is_code(kind, name)
            if not code:
                build(name)
        except ValueError as fault:
            raise ValueError(f"{kind} {name}: expected it as an object, as its name gives none: {fault}") from None
        if code and given is None:
            expected = f"expected --{kind} '{name}' too"
            raise ValueError(f"{kind} {name}: code of yours, which a run does not start; {expected}")
        self._require_unchanged(files)
        return name
