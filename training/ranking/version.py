"""The protocol of a ranking, from a file per version: scenarios, threat models, attacks, defenses, seeds, budgets."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from trust_env.agents import build_policy, knowledge_of
from trust_env.files import expanded
from trust_env.scenario import Scenario, load_scenario
from trust_env.scenario.types import Part, Size, Whole
from trust_env.scenario.yaml_lines import read_yaml
from trust_env.spaces.observation import KNOWLEDGE
from trust_env.training.exploitation.threat_models import ThreatModel, threat_model
from trust_env.training.learning.configuration import HeldOutSeed

LATEST = 1
Names = Annotated[tuple[str, ...], Field(min_length=1)]


class Quick(Part):
    validation: Size
    episodes: Size


class Full(Part):
    validation: Size
    episodes: Size
    generations: Size
    population: Size
    search_episodes: Size
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
    full: Full

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
        return [*self.attacks, *self.more_attacks.get(scenario, ())]

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
    """A published version by its number, or that of a YAML file. ValueError: there is none, or its fields are wrong."""
    if version.isdecimal():
        if not 1 <= int(version) <= LATEST:
            raise ValueError(f"version = {version}: expected a number from 1 to {LATEST}, or a YAML file")
        name = f"v{version}.yaml"
        text = (resources.files("trust_env.training.ranking") / name).read_text("utf-8")
    else:
        name, text = version, _read(expanded(version))
    return Version.model_validate(read_yaml(text, name)[0])


def _read(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as fault:
        raise ValueError(f"{file}: expected a YAML file: {fault}") from None
