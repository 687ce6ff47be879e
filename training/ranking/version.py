"""The protocol of a ranking, from a file per version: scenarios, threat models, attacks, defenses, seeds, budgets.

Beside it, in `v1_searched.yaml`, stand the attacks that a search has found for this version.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from trust_env.agents import build_policy, knowledge_of, parse_policy
from trust_env.files import expanded
from trust_env.scenario import Scenario, load_scenario
from trust_env.scenario.types import Part, Real, Size, Whole
from trust_env.scenario.yaml_lines import read_yaml
from trust_env.spaces.observation import KNOWLEDGE
from trust_env.training.exploitation.cross_entropy import searchable
from trust_env.training.exploitation.threat_models import ThreatModel, threat_model
from trust_env.training.learning.configuration import HeldOutSeed

LATEST = 1
Names = Annotated[tuple[str, ...], Field(min_length=1)]


class Quick(Part):
    validation: Size
    episodes: Size


class SearchBudget(Part):
    defense: str
    generations: Size
    population: Size
    episodes: Size
    validation: Size


class SearchedAttack(Part):
    """An attack that a search found, and its damage and that of the strongest other one, in validation episodes."""

    scenario: str
    threat: str
    given: str
    attack: str
    damage: Real
    damage_of_others: Real


class SearchedAttacks(Part):
    """The file of all that a search found for a version, and under what budget, where."""

    search: SearchBudget
    environment: str
    package: str
    numpy: str
    processor: str
    searched: tuple[SearchedAttack, ...]


class Full(Part):
    threats: Names
    validation: Size
    episodes: Size
    generations: Size
    population: Size
    search_episodes: Size
    screening: Size
    advancing: Size
    seeds: Annotated[Whole, Field(ge=0)]
    training: dict[str, Any]


class Version(Part):
    """All fields of a protocol; `v1.yaml` explains each."""

    version: Size
    scenarios: Names
    threats: Names
    seed: HeldOutSeed
    attacks: Names
    more_attacks: dict[str, tuple[str, ...]]
    defenses: Names
    references: Names
    quick: Quick
    search: SearchBudget
    full: Full
    searched: tuple[SearchedAttack, ...] = ()

    @property
    def control(self) -> str:
        """The attack that is none."""
        return self.attacks[0]

    @property
    def threat_models(self) -> list[ThreatModel]:
        """From the least to the most that adversaries observe."""
        return sorted(map(threat_model, self.threats), key=lambda model: KNOWLEDGE[model.knowledge])

    def world(self, scenario: str, threat: ThreatModel) -> Scenario:
        """A scenario with the adversaries of a threat model."""
        world = load_scenario(scenario)
        return load_scenario(world, **threat.fields(world))

    def attacks_on(self, scenario: str) -> list[str]:
        """The attacks in a scenario, whatever they need to observe."""
        found = [one.attack for one in self.searched if one.scenario == scenario]
        return list(dict.fromkeys([*self.attacks, *self.more_attacks.get(scenario, ()), *found]))

    def playable(self, scenario: str, threat: ThreatModel, *more_attacks: str) -> list[str]:
        """The attacks in a scenario, and more, that a threat model lets play, those that need the least first."""
        attacks, models = list(dict.fromkeys([*self.attacks_on(scenario), *more_attacks])), self.threat_models
        return [one for model in models[: models.index(threat) + 1] for one in self.needing(attacks, model)]

    def tunable(self, scenario: str, threat: ThreatModel, *more_attacks: str) -> list[str]:
        """Names of the built-in attacks among those that are playable and have parameters to tune."""
        specs = map(parse_policy, self.playable(scenario, threat, *more_attacks))
        names, world = dict.fromkeys(spec.name for spec in specs if spec.path is None), self.world(scenario, threat)
        return [name for name in names if name in searchable(world)]

    def needing(self, attacks: list[str], threat: ThreatModel) -> list[str]:
        """Those of some attacks that need just what a threat model gives and no earlier one of this version."""
        return [attack for attack in attacks if self._least(attack) == threat]

    def require_playable(self, attack: str) -> None:
        """ValueError: the attack is none, or needs to observe more than any threat model of this version gives."""
        if self._least(attack) is None:
            level = knowledge_of(build_policy(attack))
            raise ValueError(f"attack {attack} needs {level}, more than any of {', '.join(self.threats)} gives")

    def _least(self, attack: str) -> ThreatModel | None:
        """The threat model that observes the least of those under which an attack can be played."""
        needed = knowledge_of(build_policy(attack))
        enough = [model for model in self.threat_models if KNOWLEDGE[model.knowledge] >= KNOWLEDGE[needed]]
        return next(iter(enough), None)


def load_version(version: str = str(LATEST)) -> Version:
    """A published version by its number, or that of a YAML file, with the attacks that a search found for it.

    ValueError: there is none, or its fields are wrong.
    """
    file = version_file(version)
    fields, found = read_yaml(_read(file), file.name)[0], searched_file(version)
    if found.is_file():
        fields["searched"] = SearchedAttacks.model_validate(read_yaml(_read(found), found.name)[0]).searched
    return Version.model_validate(fields)


def version_file(version: str) -> Path:
    """The file of a version, by its number or by its path. ValueError: there is none of the number."""
    if not version.isdecimal():
        return expanded(version)
    if not 1 <= int(version) <= LATEST:
        raise ValueError(f"version = {version}: expected a number from 1 to {LATEST}, or a YAML file")
    return Path(str(resources.files("trust_env.training.ranking"))) / f"v{version}.yaml"


def searched_file(version: str) -> Path:
    """Where the attacks stand that a search found for a version, whether there are any or not."""
    file = version_file(version)
    return file.with_name(f"{file.stem}_searched.yaml")


def _read(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as fault:
        raise ValueError(f"{file}: expected a YAML file: {fault}") from None
