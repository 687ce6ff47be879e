"""Attacks against defenses, on the same episodes.

results = evaluate("patrol", attacks="honest,false_positive", defenses="score,trust", episodes=50)
results["false_positive", "trust"].summary["damage_per_frame"].iqm
results.difference(("false_positive", "trust"), ("false_positive", "score"), "damage_per_frame")
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from trust_env.agents import Player, build_policy, sufficient_knowledge
from trust_env.batch import checked_seed
from trust_env.defenses import build_defense
from trust_env.metrics import METRICS, EpisodeMetrics
from trust_env.parallel import TrustEnv
from trust_env.scenario import Scenario, load_scenario
from trust_env.training.console import progress as progress_bar
from trust_env.training.evaluation.configuration import Contender, configuration, contenders
from trust_env.training.evaluation.results import Cell, Results
from trust_env.training.evaluation.run_folder import RunFolder
from trust_env.vector import VectorEnv

MOST_WORLDS = 1024  # played at a time; a world is the same in whatever batch
Advance = Callable[[int], None]


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
    `my_file.py:MyDefense`, in a text with commas or in a list, in which objects will do as well. Where an
    attack needs a higher knowledge level than the scenario's, all cells are played at the least that all
    need; `Results.notes` says so. out: a new or empty folder for results.parquet and results.json, to which a
    finished cell is added at once; `resume` continues the run in it.

    Raises ValueError for what cannot be played, OSError for a folder that cannot be written, both at once.
    """
    own = {"knowledge": knowledge, "targets.data": data, "actuation": actuation}
    world = load_scenario(scenario, **{k: v for k, v in own.items() if v is not None}, **(overrides or {}))
    attackers, defenders = (
        contenders("attack", attacks, build_policy),
        contenders("defense", defenses, build_defense),
    )
    level = sufficient_knowledge(world, *(attacker.make() for attacker in attackers))
    notes = _notes(world, level, attackers)
    world = load_scenario(world, knowledge=level)
    run = _Run(
        world, attackers, defenders, positive("episodes", episodes), checked_seed(seed), max_cycles, notes
    )
    run.rehearse()
    folder = None
    if out is not None:
        settings = configuration(run.scenario, attackers, defenders, run.episodes, run.seed, run.horizon)
        folder = RunFolder(out, settings, run.episodes * len(attackers) * len(defenders), resume)
        run.cells = {cell.key: cell for cell in folder.cells}
        folder.save(run.results())
    run.play(folder, progress)
    return run.results()


def _notes(scenario: Scenario, level: str, attackers: list[Contender]) -> tuple[str, ...]:
    """What the reader of the results has to know."""
    notes: list[str] = []
    if level != scenario.knowledge:
        needing = [a.name for a in attackers if sufficient_knowledge(scenario, a.make()) == level]
        notes.append(
            f"knowledge: {scenario.knowledge} in the scenario, {level} here for all cells, needed by "
            f"{', '.join(needing)} (truth and detections are the same at every level)"
        )
    if "adversary" not in scenario.roles:
        notes.append(f"{scenario.name} has no adversaries, so that all attacks come to the same")
    return tuple(notes)


class _Run:
    """The cells of one evaluation, as they get finished."""

    def __init__(
        self,
        scenario: Scenario,
        attackers: list[Contender],
        defenders: list[Contender],
        episodes: int,
        seed: int,
        max_cycles: int | None,
        notes: tuple[str, ...],
    ):
        self.scenario, self.attackers, self.defenders = scenario, attackers, defenders
        self.episodes, self.seed, self.max_cycles, self.notes = episodes, seed, max_cycles, notes
        self.horizon = scenario.horizon if max_cycles is None else positive("max_cycles", max_cycles)
        self.cells: dict[tuple[str, str], Cell] = {}

    def pairs(self) -> list[tuple[Contender, Contender]]:
        return [(attacker, defender) for attacker in self.attackers for defender in self.defenders]

    def rehearse(self) -> None:
        """A frame of every attack and of every defense, so that what does not fit is refused at once."""
        first = [(attacker, self.defenders[0]) for attacker in self.attackers]
        for attacker, defender in first + [(self.attackers[0], defender) for defender in self.defenders[1:]]:
            self._play_worlds(attacker, defender, np.arange(1), 1, lambda _: None)

    def play(self, folder: RunFolder | None, progress: bool) -> None:
        missing = [(a, d) for a, d in self.pairs() if (a.name, d.name) not in self.cells]
        batches = -(-self.episodes // MOST_WORLDS)
        with progress_bar("evaluate", len(missing) * batches * self.horizon, progress) as (advance, tell):
            for attacker, defender in missing:
                tell(f"{attacker.name} x {defender.name}")
                self.cells[attacker.name, defender.name] = self._play_cell(attacker, defender, advance)
                if folder is not None:
                    folder.save(self.results())

    def _play_cell(self, attacker: Contender, defender: Contender, advance: Advance) -> Cell:
        chunks = np.array_split(np.arange(self.episodes), -(-self.episodes // MOST_WORLDS))
        found = [self._play_worlds(attacker, defender, worlds, self.horizon, advance) for worlds in chunks]
        metrics = {name: np.concatenate([part[name] for part in found]) for name in METRICS}
        return Cell(attacker.name, defender.name, metrics)

    def _play_worlds(
        self, attacker: Contender, defender: Contender, worlds: np.ndarray, frames: int, advance: Advance
    ) -> dict[str, np.ndarray]:
        venv = VectorEnv(self.scenario, defender.make(), len(worlds), self.max_cycles, autoreset=False)
        try:
            return play_worlds(venv, {"adversary": attacker.make()}, worlds, self.seed, frames, advance)
        finally:
            venv.close()

    def results(self) -> Results:
        """The cells finished so far, in the order asked for."""
        keys = [(attacker.name, defender.name) for attacker, defender in self.pairs()]
        cells = tuple(self.cells[key] for key in keys if key in self.cells)
        version = TrustEnv.metadata["name"]
        return Results(self.scenario.name, self.seed, self.episodes, version, cells, self.notes)


def play_worlds(
    venv: VectorEnv,
    policies: Mapping[str, Any],
    worlds: np.ndarray,
    seed: int,
    frames: int,
    advance: Advance = lambda _: None,
) -> dict[str, np.ndarray]:
    """The metrics of episode 0 of the given worlds[venv.num_worlds] of a seed, float64[len(worlds)] each.

    policies: by role or agent, as a `Player` takes them.
    """
    player, metrics = Player(venv, policies), EpisodeMetrics(venv)
    observations, _ = venv.reset(seed, options={"worlds": worlds, "episodes": np.zeros_like(worlds)})
    for _ in range(frames):
        observations, _, _, _, info = venv.step(player.actions(observations))
        metrics.update(info)
        advance(1)
    return metrics.result()


def positive(name: str, value: Any) -> int:
    """The value as an int; ValueError if it is not a whole number of at least 1."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise ValueError(f"{name} must be a whole number of at least 1; got {value!r}")
    return int(value)
