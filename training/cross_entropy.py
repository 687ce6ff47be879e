"""Where a cross-entropy search draws attacks from: a distribution over their parameters.

Rubinstein, "The cross-entropy method for combinatorial and continuous optimization", 1999: draw, keep the
best, move the distribution toward them. Numbers come from a normal distribution over their range (what falls
out of it is moved to its end, where the best often lies), names from a table of probabilities. An inner
attack is a name with a distribution of its own, which learns from those draws alone that took it.
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from agents import POLICIES, knowledge_of, parse_policy
from agents.ranges import RANGES, Range, resolved
from trust_env.observation import KNOWLEDGE
from trust_env.scenario import Scenario
from trust_env.spec import Spec

LEARNING = 0.7  # weight of the best against what was learned before
NARROWEST = 0.03  # standard deviation, as a share of the range
RAREST = 0.02  # probability of a name


class Distribution(Protocol):
    """Of one parameter."""

    def draw(self, rng: np.random.Generator) -> Any: ...

    def likeliest(self) -> Any: ...

    def learn(self, values: Sequence[Any]) -> None: ...


def attacks_like(spec: Spec, scenario: Scenario) -> Attacks:
    """Where to draw attacks like `spec` from; ValueError if there is nothing to search."""
    if spec.path is not None or spec.name not in RANGES:
        known = ", ".join(RANGES)
        raise ValueError(f"search({spec}): its parameters have no ranges; expected one of {known}")
    attacks = Attacks(spec, scenario)
    if not attacks.free:
        raise ValueError(f"search({spec}): all of its parameters are given; expected some to search")
    return attacks


class Attacks:
    """A distribution over attacks of one kind; what the spec says already stays as it is."""

    def __init__(self, spec: Spec, scenario: Scenario):
        self.spec = spec
        self.parameters: dict[str, Distribution] = {}
        for name, values in RANGES.get(spec.name, {}).items() if spec.path is None else ():
            if name == "inner":
                given = [spec.params[name]] if name in spec.params else _playable(values, scenario)
                self.parameters[name] = Inner([parse_policy(text) for text in given], scenario)
            elif name not in spec.params:
                ranged = isinstance(values, Range)
                self.parameters[name] = Numbers(resolved(values, scenario)) if ranged else Names(values)

    @property
    def free(self) -> bool:
        """Whether there is anything to draw."""
        return any(p.free if isinstance(p, Inner) else True for p in self.parameters.values())

    def draw(self, rng: np.random.Generator) -> Spec:
        drawn = {name: parameter.draw(rng) for name, parameter in self.parameters.items()}
        return Spec(self.spec.name, self.spec.params | drawn)

    def likeliest(self) -> Spec:
        found = {name: parameter.likeliest() for name, parameter in self.parameters.items()}
        return Spec(self.spec.name, self.spec.params | found)

    def learn(self, best: Sequence[Spec]) -> None:
        """Move toward the best; what one of them does not say is as by default."""
        for name, parameter in self.parameters.items():
            default = inspect.signature(POLICIES[self.spec.name]).parameters[name].default
            parameter.learn([spec.params.get(name, default) for spec in best])


def _playable(names: Sequence[Any], scenario: Scenario) -> list[str]:
    """Those that need to know no more than the scenario gives."""
    level = KNOWLEDGE[scenario.knowledge]
    return [name for name in names if KNOWLEDGE[knowledge_of(POLICIES[name])] <= level]


class Numbers:
    """Of a range; `mean` and `std` in shares of it."""

    def __init__(self, given: Range):
        self.low, self.high, self.whole = float(given.low), float(given.high), given.whole
        self.none = given.none
        self.mean, self.std = 0.5, 0.5

    def draw(self, rng: np.random.Generator) -> float | int:
        return self._at(float(np.clip(rng.normal(self.mean, self.std), 0.0, 1.0)))

    def likeliest(self) -> float | int:
        return self._at(self.mean)

    def _at(self, share: float) -> float | int:
        if not self.whole:
            return min(self.high, float(f"{self.low + share * (self.high - self.low):.3g}"))
        return int(min(self.high, self.low + np.floor(share * (self.high - self.low + 1.0))))

    def learn(self, values: Sequence[Any]) -> None:
        numbers = [self.none if value is None else value for value in values]
        shares = [self._share(float(number)) for number in numbers if number is not None]
        if not shares:
            return
        self.mean += LEARNING * (float(np.mean(shares)) - self.mean)
        self.std = max(NARROWEST, self.std + LEARNING * (float(np.std(shares)) - self.std))

    def _share(self, value: float) -> float:
        """Where `_at` gives the value."""
        if self.whole:
            return float(np.clip((value - self.low + 0.5) / (self.high - self.low + 1.0), 0.0, 1.0))
        return float(np.clip((value - self.low) / max(self.high - self.low, 1e-12), 0.0, 1.0))


class Names:
    """Of a list of values; `probability` of each."""

    def __init__(self, values: Sequence[Any]):
        self.values = list(values)
        self.probability = np.full(len(self.values), 1.0 / len(self.values))

    def draw(self, rng: np.random.Generator) -> Any:
        return self.values[int(rng.choice(len(self.values), p=self.probability))]

    def likeliest(self) -> Any:
        return self.values[int(self.probability.argmax())]

    def learn(self, values: Sequence[Any]) -> None:
        share = np.array([values.count(value) for value in self.values]) / len(values)
        mixed = np.maximum(self.probability + LEARNING * (share - self.probability), RAREST)
        self.probability = mixed / mixed.sum()


class Inner:
    """Attacks by their names; each has parameters of its own."""

    def __init__(self, specs: Sequence[Spec], scenario: Scenario):
        self.attacks = {spec.name: Attacks(spec, scenario) for spec in specs}
        self.names = Names(list(self.attacks))

    @property
    def free(self) -> bool:
        return len(self.attacks) > 1 or any(attacks.free for attacks in self.attacks.values())

    def draw(self, rng: np.random.Generator) -> str:
        return str(self.attacks[self.names.draw(rng)].draw(rng))

    def likeliest(self) -> str:
        return str(self.attacks[self.names.likeliest()].likeliest())

    def learn(self, values: Sequence[str]) -> None:
        specs = [parse_policy(value) for value in values]
        self.names.learn([spec.name for spec in specs])
        for name, attacks in self.attacks.items():
            own = [spec for spec in specs if spec.name == name]
            if own:
                attacks.learn(own)
