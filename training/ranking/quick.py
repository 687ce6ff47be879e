"""The quick ranking: the version's attacks, listed and searched before a defense was known, against every defense."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from trust_env.agents import build_policy
from trust_env.defenses import build_defense, named_in_full
from trust_env.scenario import Scenario
from trust_env.training.evaluation.cell import Cell
from trust_env.training.evaluation.configuration import configuration, named_specs
from trust_env.training.evaluation.evaluate import evaluate
from trust_env.training.evaluation.results import cells_of
from trust_env.training.evaluation.run_folder import ROWS, read_run, require_same_configuration
from trust_env.training.exploitation.threat_models import ThreatModel
from trust_env.training.ranking.cells import Cells, split
from trust_env.training.ranking.row import Row, row
from trust_env.training.ranking.timing import time_ratio
from trust_env.training.ranking.version import Version

Played = Mapping[str, Cells]  # by attack


def quick_rows(
    version: Version, defenses: Sequence[str], more_attacks: Sequence[str], folder: Path | None, progress: bool
) -> Iterator[Row]:
    """A row for every scenario, threat model and defense, references last.

    more_attacks: beside those of the version; they may be the worst, but do not count in the means. folder: where
    finished cells are kept, and from where they are taken; None: nowhere.
    """
    for scenario in version.scenarios:
        references = {
            name: _played(version, scenario, name, more_attacks, folder, progress) for name in version.references
        }
        for defense in [*defenses, *version.references]:
            found = references.get(defense) or _played(version, scenario, defense, more_attacks, folder, progress)
            cells: dict[str, Cells] = {}
            for threat in version.threat_models:
                cells |= found[threat.label]
                time = time_ratio(version.world(scenario, threat), defense)
                between = {name: _up_to(played, threat, version) for name, played in references.items()}
                yield row(version, scenario, threat, defense, cells, between, time)


def _up_to(found: Mapping[str, Played], threat: ThreatModel, version: Version) -> Played:
    """What was played under a threat model and those before it."""
    cells: dict[str, Cells] = {}
    for model in version.threat_models:
        cells |= found[model.label]
        if model == threat:
            break
    return cells


def _played(
    version: Version, scenario: str, defense: str, more_attacks: Sequence[str], folder: Path | None, progress: bool
) -> dict[str, Played]:
    """The cells of a defense in a scenario, by the label of the first threat model under which each can be played."""
    found: dict[str, Played] = {}
    for threat in version.threat_models:
        attacks = version.needing(list(dict.fromkeys([*version.attacks_on(scenario), *more_attacks])), threat)
        if not attacks:
            found[threat.label] = {}
            continue
        if progress:
            print(f"trust-env: rank: {defense} on {scenario}, {threat.label}", file=sys.stderr)
        at = (
            None
            if folder is None
            else folder / "parts" / folder_name(scenario) / threat.label / folder_name(named_in_full(defense))
        )
        world, count = version.world(scenario, threat), version.quick.validation + version.quick.episodes
        cells = _finished(at, world, attacks, defense, count, version.seed)
        if len(cells) < len(attacks):
            cells = evaluate(world, attacks, [defense], count, version.seed, at, True, progress=progress).cells
        found[threat.label] = {cell.attack: split(cell, version.quick.validation) for cell in cells}
    return found


def _finished(
    folder: Path | None, world: Scenario, attacks: Sequence[str], defense: str, episodes: int, seed: int
) -> Sequence[Cell]:
    """The finished cells in a folder. ValueError: they are of another configuration."""
    if folder is None or not (folder / ROWS).is_file():
        return ()
    table, saved, strata = read_run(folder)
    named = named_specs("attack", attacks, build_policy), named_specs("defense", [defense], build_defense)
    settings = configuration(world, *named, episodes, seed, world.horizon)
    require_same_configuration(folder, saved, json.loads(json.dumps(settings)))
    return cells_of(table, strata)


def folder_name(name: str) -> str:
    """The name of a scenario or a defense in letters, digits and _, as paths of training runs hold no brackets."""
    return re.sub(r"[^\w.-]+", "_", name).strip("_")
