"""The full ranking: attacks searched and trained against every defense under the version's budget."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from trust_env.defenses import named_in_full
from trust_env.scenario import Scenario
from trust_env.training.evaluation.evaluate import evaluate
from trust_env.training.exploitation.comparison import Attacker
from trust_env.training.exploitation.exploit import exploit
from trust_env.training.exploitation.report import Exploitability
from trust_env.training.exploitation.threat_models import ThreatModel
from trust_env.training.ranking.cells import Cells
from trust_env.training.ranking.quick import folder_name
from trust_env.training.ranking.row import Row, row
from trust_env.training.ranking.timing import time_ratio
from trust_env.training.ranking.version import Version


def full_rows(
    version: Version, defenses: Sequence[str], more_attacks: Sequence[str], folder: Path, progress: bool
) -> Iterator[Row]:
    """A row for every scenario, threat model and defense.

    folder: where finished searches, training runs and cells are kept, and from where they are taken.
    """
    for scenario in version.scenarios:
        for threat in version.threat_models:
            for defense in defenses:
                yield _row(version, scenario, threat, defense, more_attacks, folder, progress)


def exploit_folder(folder: Path, scenario: str, threat: str, defense: str) -> Path:
    """Where the exploitation of a defense stands in the folder of a full ranking."""
    return folder / "parts" / folder_name(scenario) / threat / folder_name(named_in_full(defense)) / "exploit"


def _row(
    version: Version,
    scenario: str,
    threat: ThreatModel,
    defense: str,
    more_attacks: Sequence[str],
    folder: Path,
    progress: bool,
) -> Row:
    world, kept = version.world(scenario, threat), exploit_folder(folder, scenario, threat.label, defense)
    attacks = _attacks(version, scenario, more_attacks, threat)
    found = _exploit(version, world, threat, defense, attacks, kept, progress)
    cells = {
        _name(attacker): Cells(
            found.validation[attacker.attack, found.defense], found.results[attacker.attack, found.defense]
        )
        for attacker in found.attackers
    }
    worst = found.worst()
    assert worst is not None
    counts = (version.full.episodes, version.seed, kept.with_name("references"))
    reference = evaluate(world, [worst.attack], version.references, *counts, resume=True, progress=progress)
    between = {
        name: {_name(worst): Cells(cell, cell)}
        for name in version.references
        for cell in [reference[worst.attack, name]]
    }
    return row(version, scenario, threat, defense, cells, between, time_ratio(world, defense))


def _name(attacker: Attacker) -> str:
    """By which anybody can play it, but for a training run, of which nobody else has the folder."""
    return attacker.name if attacker.kind == "learned" else attacker.attack


def _exploit(
    version: Version,
    world: Scenario,
    threat: ThreatModel,
    defense: str,
    attacks: Sequence[str],
    folder: Path,
    progress: bool,
) -> Exploitability:
    budget = version.full
    return exploit(
        world,
        defense,
        folder,
        ",".join(attacks),
        seeds=budget.seeds,
        episodes=budget.episodes,
        seed=version.seed,
        threat=threat.label,
        validation=budget.validation,
        search_options={
            "generations": budget.generations,
            "population": budget.population,
            "episodes": budget.search_episodes,
            "screening": budget.screening,
            "advancing": budget.advancing,
        },
        overrides=budget.training,
        resume=True,
        progress=progress,
    )


def _attacks(version: Version, scenario: str, more_attacks: Sequence[str], threat: ThreatModel) -> list[str]:
    """All that can be played under the threat model, and a search of each that has parameters to tune."""
    searches = [f"search({name})" for name in version.tunable(scenario, threat, *more_attacks)]
    return [*version.playable(scenario, threat, *more_attacks), *searches]
