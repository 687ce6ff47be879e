"""Attacks tuned against one defense before others are ranked: those that are stronger than all of the version's list.

found = search_attacks(out="RUN")     # writes v1_searched.yaml beside v1.yaml, of which the quick ranking plays all
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trust_env.agents import POLICIES, parse_policy
from trust_env.files import expanded, locked, require_empty, write_atomically
from trust_env.scenario.yaml_lines import write_yaml
from trust_env.training.console import format_number
from trust_env.training.evaluation.evaluate import evaluate
from trust_env.training.evaluation.results import DAMAGE
from trust_env.training.evaluation.statistics import paired_mean_difference
from trust_env.training.exploitation.exploit_folder import ExploitFolder
from trust_env.training.exploitation.exploit_run import validation_seed
from trust_env.training.exploitation.search import search
from trust_env.training.exploitation.threat_models import ThreatModel
from trust_env.training.ranking.quick import folder_name
from trust_env.training.ranking.ranking import made_with
from trust_env.training.ranking.version import LATEST, SearchedAttack, Version, load_version, searched_file

COMMENT = (
    "# Written by `trust-env rank --search`. Each attack does more damage to the defense than all others of its name\n"
    "# in the version's list, by the 95 % interval of the paired difference in validation episodes.\n"
)


@dataclass(frozen=True)
class Searches:
    """`outcomes`: of every search, by scenario and threat model; kept: those that found a stronger attack."""

    file: Path
    kept: tuple[SearchedAttack, ...]
    outcomes: dict[str, dict[str, Any]]

    def to_dict(self) -> dict[str, Any]:
        return {"file": str(self.file), "searched": [one.model_dump() for one in self.kept], "outcomes": self.outcomes}

    def print(self, console: Any) -> None:
        """Print the attacks that were kept, and what all the searches took."""
        for one in self.kept:
            damages = f"{format_number(one.damage)} rather than {format_number(one.damage_of_others)}"
            line = f"{one.scenario}, {one.threat}: {one.attack}: damage {damages}"
            console.print(line, markup=False, soft_wrap=True, highlight=False)
        minutes = sum(found["seconds"] for found in self.outcomes.values()) / 60.0
        text = f"{len(self.kept)} of {len(self.outcomes)} searches found a stronger attack, in {minutes:.1f} min"
        console.print(f"{text}: {self.file}", markup=False, soft_wrap=True, highlight=False)


def search_attacks(
    version: str = str(LATEST), out: str | Path | None = None, resume: bool = False, progress: bool = True
) -> Searches:
    """Search every attack of a version that has parameters to tune against the defense of its `search`.

    In every scenario an attack is searched under the threat model that gives just what it needs, and one that plays
    another attack under all that give more, too. What is found is kept where it does more damage than all attacks of
    its name that are played already. The kept ones are written into a file beside that of the version (v1_searched.yaml
    beside v1.yaml). out: a new or empty folder for every finished search; `resume` continues there.

    Raises ValueError for what cannot be searched, OSError for a file or a folder that cannot be written.
    """
    if out is None:
        raise ValueError("rank search: expected out, a new or empty folder, from which it goes on when interrupted")
    protocol = load_version(version).model_copy(update={"searched": ()})
    file, folder = searched_file(version), expanded(out)
    with locked(folder):
        if not resume:
            require_empty(folder, "--resume to continue the search in it")
        outcomes: dict[str, dict[str, Any]] = {}
        for scenario in protocol.scenarios:
            for threat in protocol.threat_models:
                part = _Part(protocol, scenario, threat, folder / "parts" / folder_name(scenario) / threat.label)
                protocol = part.search(progress)
                outcomes |= {f"{scenario}, {threat.label}, {name}": one for name, one in part.folder.searches.items()}
    write_atomically(file, lambda path: path.write_text(_text(protocol), encoding="utf-8"))
    return Searches(file, protocol.searched, outcomes)


def _text(version: Version) -> str:
    fields = version.model_dump(mode="json", include={"search", "searched"})
    return COMMENT + write_yaml({"search": fields["search"], **made_with(), "searched": fields["searched"]})


class _Part:
    """The searches in a scenario under a threat model."""

    def __init__(self, version: Version, scenario: str, threat: ThreatModel, folder: Path):
        self.version, self.scenario, self.threat = version, scenario, threat
        self.world = version.world(scenario, threat)
        settings = {"scenario": self.world.model_dump(mode="json"), "attacks": version.attacks_on(scenario)}
        settings |= {"search": version.search.model_dump(), "seed": version.seed}
        self.folder = ExploitFolder(folder, settings, resume=True)

    def search(self, progress: bool) -> Version:
        """The version with the attacks that were found here and kept."""
        for name in self._names():
            if name not in self.folder.searches:
                if progress:
                    text = f"search({name}) on {self.scenario}, {self.threat.label}"
                    print(f"trust-env: rank: {text}", file=sys.stderr)
                self.folder.searches[name] = self._found(name, progress)
                self.folder.save()
            self.version = self._with(name, self.folder.searches[name])
        return self.version

    def _names(self) -> list[str]:
        """Those not searched under a threat model that gives less, and those that there had fewer attacks to play."""
        models = self.version.threat_models
        earlier = models[: models.index(self.threat)]
        searched = {name for model in earlier for name in self.version.tunable(self.scenario, model)}
        names = self.version.tunable(self.scenario, self.threat)
        return [name for name in names if name not in searched or POLICIES[name].policy_parameters]

    def _found(self, name: str, progress: bool) -> dict[str, Any]:
        """The outcome of a search, and the damage in validation episodes of what it found and of its rivals."""
        budget = self.version.search
        counts = {"generations": budget.generations, "population": budget.population, "episodes": budget.episodes}
        seed, options = self.version.seed, {"knowledge": self.world.knowledge, "progress": progress}
        found = search(self.world, budget.defense, name, **counts, seed=seed, **options).to_dict()
        return found | self._compared(found["attack"], self._rivals(name), progress)

    def _rivals(self, name: str) -> list[str]:
        """The attack as it is by default, and the others of its name that are played."""
        playable = self.version.playable(self.scenario, self.threat)
        same = [one for one in playable if (spec := parse_policy(one)).name == name and spec.path is None]
        return list(dict.fromkeys([name, *same]))

    def _compared(self, attack: str, rivals: list[str], progress: bool) -> dict[str, Any]:
        """Mean damage of the attack and of the strongest rival, and the least that the attack is stronger than all."""
        budget, attacks = self.version.search, list(dict.fromkeys([attack, *rivals]))
        seed = validation_seed(self.version.seed)
        results = evaluate(self.world, attacks, budget.defense, budget.validation, seed, progress=progress)
        damage = {cell.attack: cell.metrics[DAMAGE] for cell in results.cells}
        margins = [paired_mean_difference(damage[attack], damage[rival]) for rival in rivals]
        return {
            "damage": float(damage[attack].mean()),
            "damage_of_others": max(float(damage[rival].mean()) for rival in rivals),
            "margin": min(margin.low for margin in margins if margin is not None),
        }

    def _with(self, name: str, found: dict[str, Any]) -> Version:
        """The version with what a search found, where that is stronger than all others of its name."""
        if found["margin"] <= 0.0:
            return self.version
        fields = {field: found[field] for field in ("attack", "damage", "damage_of_others")}
        kept = SearchedAttack(scenario=self.scenario, threat=self.threat.label, given=name, **fields)
        return self.version.model_copy(update={"searched": (*self.version.searched, kept)})
