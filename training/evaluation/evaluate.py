"""Attacks against defenses, on the same episodes.

results = evaluate("patrol", attacks="honest,false_positive", defenses="score,trust", episodes=50)
results["false_positive", "trust"].summary["damage_per_frame"].iqm
results.difference(("false_positive", "trust"), ("false_positive", "score"), "damage_per_frame")
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from trust_env.agents import build_policy, sufficient_knowledge
from trust_env.batch import checked_seed
from trust_env.defenses import BuiltIn, build_defense
from trust_env.errors import positive_int
from trust_env.files import expanded, locked
from trust_env.parallel import TrustEnv
from trust_env.scenario import Scenario, load_scenario
from trust_env.training.console import Advance, progress_bar
from trust_env.training.evaluation.cell import Batch, Cell, join_batches
from trust_env.training.evaluation.configuration import NamedSpec, configuration, named_specs
from trust_env.training.evaluation.play import measure_frames, play_frames
from trust_env.training.evaluation.replay_code import Setting
from trust_env.training.evaluation.results import Results
from trust_env.training.evaluation.run_folder import RunFolder
from trust_env.vector import VectorEnv

MAX_WORLDS = 1024  # of a batch; results do not depend on it


def evaluate(
    scenario: Any = "patrol",
    attacks: str | Iterable[Any] = "honest",
    defenses: str | Iterable[Any] = "trust",
    episodes: int = 50,
    seed: int = 0,
    out: str | Path | None = None,
    resume: bool = False,
    knowledge: str | None = None,
    data: str | Path | None = None,
    actuation: str | None = None,
    max_cycles: int | None = None,
    overrides: Mapping[str, Any] | None = None,
    progress: bool = True,
) -> Results:
    """Play every attack against every defense on the same episodes of a seed; benign agents are honest.

    scenario: as `load_scenario` takes it; `knowledge`, `data` (the recording), `actuation` and `overrides`
    (by field, {"tracker.gate": 0.95}) change it. attacks, defenses: names, `trust(preset=cdc2024)`,
    `my_file.py:MyDefense`, in a text with commas or in a list, which may also hold objects. Where an
    attack needs a higher knowledge level than the scenario's, all cells are played at the least that all
    need, and `Results.notes` says so. out: a new or empty folder for results.parquet and results.json, to
    which a finished cell is added at once; `resume` continues the run in it.

    Before anything is computed it raises ValueError for what cannot be played, OSError for a folder that
    cannot be written.
    """
    options = {"knowledge": knowledge, "targets.data": data, "actuation": actuation}
    given = {name: value for name, value in options.items() if value is not None}
    world = load_scenario(scenario, **given, **(overrides or {}))
    attack_specs = named_specs("attack", attacks, build_policy)
    defense_specs = named_specs("defense", defenses, build_defense)
    level = sufficient_knowledge(world, *(attack.construct() for attack in attack_specs))
    run = _Evaluation(
        load_scenario(world, knowledge=level),
        attack_specs,
        defense_specs,
        positive_int("episodes", episodes),
        checked_seed(seed),
        None if max_cycles is None else positive_int("max_cycles", max_cycles),
        _notes(world, level, attack_specs),
        _setting(scenario, world, level, given | dict(overrides or {}), max_cycles),
    )
    run.play_first_frames()
    if out is None:
        run.play(None, progress)
    else:
        run.play_in(expanded(out), resume, progress)
    return run.results()


def _setting(
    source: Any, scenario: Scenario, level: str, changes: Mapping[str, Any], max_cycles: int | None
) -> Setting:
    raised = {"knowledge": level} if level != scenario.knowledge else {}
    plain = {name: str(value) if isinstance(value, Path) else value for name, value in changes.items()}
    return Setting(str(source) if isinstance(source, (str, Path)) else None, plain | raised, max_cycles)


def _notes(scenario: Scenario, level: str, attacks: list[NamedSpec]) -> tuple[str, ...]:
    """What is to be known beside the results: a raised knowledge level, the absence of adversaries."""
    notes: list[str] = []
    if level != scenario.knowledge:
        needing = [a.name for a in attacks if sufficient_knowledge(scenario, a.construct()) == level]
        notes.append(
            f"knowledge: {scenario.knowledge} in the scenario, {level} here for all cells, needed by "
            f"{', '.join(needing)} (truth and detections are the same at every level)"
        )
    if "adversary" not in scenario.roles:
        notes.append(f"{scenario.name} has no adversaries, so that all attacks come to the same")
    return tuple(notes)


@dataclass
class _Evaluation:
    """The cells of one evaluation; `cells` are the finished ones."""

    scenario: Scenario
    attacks: list[NamedSpec]
    defenses: list[NamedSpec]
    episodes: int
    seed: int
    max_cycles: int | None
    notes: tuple[str, ...]
    setting: Setting
    cells: dict[tuple[str, str], Cell] = field(default_factory=dict)
    missing: dict[str, np.ndarray] = field(default_factory=dict)  # by attack, phantoms without a place, [episodes]

    @property
    def horizon(self) -> int:
        return self.scenario.horizon if self.max_cycles is None else self.max_cycles

    def pairs(self) -> list[tuple[NamedSpec, NamedSpec]]:
        return [(attack, defense) for attack in self.attacks for defense in self.defenses]

    def play_first_frames(self) -> None:
        """Play one frame of every attack and of every defense, so that what does not fit raises at once, and the
        episodes are known in which there is no place for all phantoms of an attack.
        """
        for defense in self.defenses:
            self._play_worlds(self.attacks[0], defense, np.arange(1), 1, lambda _: None)
        for attack in self.attacks:
            for worlds in self._batches():
                policy = attack.construct()
                self._play_policy(policy, self.defenses[0], worlds, 1, lambda _: None)
                if (missing := getattr(policy, "missing_phantoms", None)) is None:
                    break
                self.missing[attack.name] = np.append(self.missing.get(attack.name, ()), missing)

    def play_in(self, path: Path, resume: bool, progress: bool) -> None:
        """Play the cells that are missing in a folder, in which no other process is at work."""
        settings = configuration(self.scenario, self.attacks, self.defenses, self.episodes, self.seed, self.horizon)
        with locked(path):
            folder = RunFolder(path, settings, self.episodes * len(self.pairs()), resume)
            self.cells = {cell.key: cell for cell in folder.cells}
            folder.save(self.results())
            self.play(folder, progress)

    def play(self, folder: RunFolder | None, progress: bool) -> None:
        """Play all cells that are missing, and save each in the folder as soon as it is finished."""
        missing = [(a, d) for a, d in self.pairs() if (a.name, d.name) not in self.cells]
        total = len(missing) * len(self._batches()) * self.horizon
        with progress_bar("evaluate", total, progress) as (advance, describe):
            for attack, defense in missing:
                describe(f"{attack.name} x {defense.name}")
                self.cells[attack.name, defense.name] = self._play_cell(attack, defense, advance)
                if folder is not None:
                    folder.save(self.results())

    def _batches(self) -> list[np.ndarray]:
        """The worlds of the episodes, in batches."""
        return np.array_split(np.arange(self.episodes), -(-self.episodes // MAX_WORLDS))

    def _play_cell(self, attack: NamedSpec, defense: NamedSpec, advance: Advance) -> Cell:
        found = [self._play_worlds(attack, defense, worlds, self.horizon, advance) for worlds in self._batches()]
        return join_batches(attack.name, defense.name, found, self.horizon)

    def _play_worlds(
        self, attack: NamedSpec, defense: NamedSpec, worlds: np.ndarray, frames: int, advance: Advance
    ) -> Batch:
        return self._play_policy(attack.construct(), defense, worlds, frames, advance)

    def _play_policy(self, policy: Any, defense: NamedSpec, worlds: np.ndarray, frames: int, advance: Advance) -> Batch:
        venv = VectorEnv(self.scenario, defense.construct(), len(worlds), self.max_cycles, autoreset=False)
        try:
            infos = play_frames(venv, {"adversary": policy}, worlds, self.seed, frames, advance)
            metrics = measure_frames(venv, infos)
            found = metrics.result(), metrics.reliability(), metrics.strata()
            return Batch(*found, metrics.courses(), metrics.trust_scores())
        finally:
            venv.close()

    def results(self) -> Results:
        """The cells finished so far, in the order asked for."""
        keys = [(attack.name, defense.name) for attack, defense in self.pairs()]
        cells = tuple(self.cells[key] for key in keys if key in self.cells)
        version = TrustEnv.metadata["name"]
        notes = (*self.notes, *self._notes_on_phantoms(), *self._notes_on_trust())
        level = self.scenario.knowledge
        return Results(self.scenario.name, self.seed, self.episodes, version, cells, notes, level, self.setting)

    def _notes_on_phantoms(self) -> list[str]:
        """A line for every attack for whose phantoms some episodes have no place."""
        return [
            f"{attack}: {missing.mean():.2g} of its phantoms an episode have no place ({(missing > 0).sum():.0f} of "
            f"{self.episodes} episodes lack some)"
            for attack, missing in self.missing.items()
            if missing.any()
        ]

    def _notes_on_trust(self) -> list[str]:
        """A line for every defense of the user's own that has no opinion of any track in any finished cell."""
        notes = []
        for defense in self.defenses:
            cells = [cell for cell in self.cells.values() if cell.defense == defense.name]
            undecided = bool(cells) and all(cell.is_undecided for cell in cells)
            if undecided and not isinstance(defense.construct(), BuiltIn):
                notes.append(f"100 % of the track trust of {defense.name} is NaN: it decides nothing")
        return notes
