"""The parameters with which an attack does the most damage, by cross-entropy search on training worlds.

found = search("patrol", "trust", "false_positive")
found.attack                       # its name, such as false_positive(n=4, motion=static, ...), for `evaluate`
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from agents import build_policy, parse_policy, sufficient_knowledge
from training.configuration import contenders
from training.cross_entropy import Attacks, attacks_like
from training.evaluate import play_worlds, positive
from training.learning.configuration import TRAINING_SEEDS
from training.screen import progress as progress_bar
from trust_env.defenses import build_defense
from trust_env.scenario import Scenario, load_scenario
from trust_env.vector import VectorEnv
from trust_env.worlds import checked_seed

DAMAGE = "damage_per_frame"
ELITE = 0.25  # share of a generation from which the next one learns
FINALISTS = 4  # compared with what was given, on further worlds, as the best of many is partly luck
FINAL_EPISODES = 4  # times those of a generation
_SEARCH = re.compile(r"\s*search\s*\((?:\s*inner\s*=)?(.*)\)\s*", re.DOTALL)


@dataclass(frozen=True)
class Search:
    """What a search has found: `attack`, the best one's name; damages are means on training worlds."""

    given: str
    attack: str
    defense: str
    scenario: str
    seed: int
    damage: float  # of `attack`
    given_damage: float
    tried: int  # different attacks
    episodes: int  # played in all
    frames: int
    seconds: float
    history: list[float] = field(default_factory=list)  # of the best after every generation

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


def searched(text: str) -> str | None:
    """`false_positive` of `search(false_positive)`; None for a text that names no search."""
    found = _SEARCH.fullmatch(text)
    return found[1].strip() if found else None


def search(
    scenario: Any = "patrol",
    defense: Any = "trust",
    attack: str = "false_positive",
    generations: int = 12,
    population: int = 24,
    episodes: int = 32,
    seed: int = 0,
    knowledge: str | None = None,
    max_cycles: int | None = None,
    overrides: Mapping[str, Any] | None = None,
    progress: bool = True,
) -> Search:
    """Tune the parameters that `attack` (`false_positive`, `sleeper(inner=suppress)`) leaves open.

    In each of the generations so many attacks (population) are drawn and played in the same episodes of
    training worlds, which no evaluation sees; at last the best ones and the given one are compared on more of
    them. What is found has done at least as much damage there as the given one.

    Raises ValueError for what cannot be played or searched.
    """
    for name, value in {"generations": generations, "population": population, "episodes": episodes}.items():
        positive(name, value)
    seed = checked_seed(seed) % TRAINING_SEEDS
    world = _world(scenario, attack, knowledge, overrides or {})
    game = _Game(world, defense, seed, episodes, max_cycles)
    attacks = attacks_like(parse_policy(attack), world)
    rounds = generations * population + (FINALISTS + 2) * FINAL_EPISODES
    started = time.perf_counter()
    with progress_bar(f"search({attack})", rounds * episodes * game.horizon, progress) as (advance, _):
        game.advance = advance
        history = _improve(attacks, game, generations, population, np.random.default_rng(seed))
        found, damage = game.final(str(attacks.spec), str(attacks.likeliest()))
    return Search(
        given=str(attacks.spec),
        attack=found,
        defense=game.defense.name,
        scenario=world.name,
        seed=seed,
        damage=damage[found],
        given_damage=damage[str(attacks.spec)],
        tried=len(game.played),
        episodes=game.episodes_played,
        frames=game.episodes_played * game.horizon,
        seconds=time.perf_counter() - started,
        history=history,
    )


def _world(scenario: Any, attack: str, knowledge: str | None, overrides: Mapping[str, Any]) -> Scenario:
    """The scenario at the knowledge level given, else at the least that the attack needs."""
    if knowledge is not None:
        return load_scenario(scenario, knowledge=knowledge, **overrides)
    world = load_scenario(scenario, **overrides)
    return load_scenario(world, knowledge=sufficient_knowledge(world, build_policy(attack)))


def _improve(
    attacks: Attacks, game: _Game, generations: int, population: int, rng: np.random.Generator
) -> list[float]:
    """Draw, play, learn from the best so far; the damage of the best after every generation."""
    history: list[float] = []
    elite = max(2, round(ELITE * population))
    for generation in range(generations):
        drawn = [str(attacks.draw(rng)) for _ in range(population)]
        if generation == 0:
            drawn[0] = str(attacks.spec)
        for attack in drawn:
            game.play(attack)
        best = game.best(elite)
        attacks.learn([parse_policy(attack) for attack in best])
        history.append(game.played[best[0]])
    return history


class _Game:
    """Attacks on the same training worlds of one scenario and defense."""

    def __init__(self, scenario: Scenario, defense: Any, seed: int, episodes: int, max_cycles: int | None):
        self.scenario, self.seed, self.episodes = scenario, TRAINING_SEEDS + seed, episodes
        (self.defense,) = contenders("defense", [defense], build_defense)
        self.max_cycles = max_cycles
        self.horizon = scenario.horizon if max_cycles is None else positive("max_cycles", max_cycles)
        self.played: dict[str, float] = {}  # mean damage by attack
        self.episodes_played = 0
        self.advance: Callable[[int], None] = lambda _: None

    def play(self, attack: str) -> None:
        """Find out the attack's damage in worlds 0 to `episodes`, once."""
        if attack in self.played:
            self.advance(self.episodes * self.horizon)
        else:
            self.played[attack] = float(self._play(attack, np.arange(self.episodes)).mean())

    def best(self, count: int) -> list[str]:
        return sorted(self.played, key=self.played.__getitem__, reverse=True)[:count]

    def final(self, *others: str) -> tuple[str, dict[str, float]]:
        """The best attack in further worlds, of the best so far and others, and the damage of each there."""
        worlds = self.episodes + np.arange(FINAL_EPISODES * self.episodes)
        compared = dict.fromkeys([*others, *self.best(FINALISTS)])
        damage = {attack: float(self._play(attack, worlds).mean()) for attack in compared}
        return max(damage, key=damage.__getitem__), damage

    def _play(self, attack: str, worlds: np.ndarray) -> np.ndarray:
        def tell(frames: int) -> None:
            self.advance(frames * len(worlds))

        venv = VectorEnv(self.scenario, self.defense.make(), len(worlds), self.max_cycles, autoreset=False)
        try:
            found = play_worlds(
                venv, {"adversary": build_policy(attack)}, worlds, self.seed, self.horizon, tell
            )
        finally:
            venv.close()
        self.episodes_played += len(worlds)
        return found[DAMAGE]
