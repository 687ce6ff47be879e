"""An episode played again, to look at: of a run, or one that is described.

replay("RUN", row=17, out="episode.html")
replay(scenario="patrol", attack="false_positive", defense="trust", beside="score", seed=3, out="episode.gif")
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace as changed
from pathlib import Path
from typing import Any

from trust_env.agents import build_policy, sufficient_knowledge
from trust_env.batch import checked_seed
from trust_env.defenses import build_defense
from trust_env.errors import positive_int
from trust_env.files import expanded
from trust_env.metrics import METRICS
from trust_env.scenario import load_scenario
from trust_env.training.evaluation.configuration import named_specs
from trust_env.training.pages.page import render, save_page
from trust_env.training.replays.episode import Episode, Run
from trust_env.training.replays.gif import save_gif
from trust_env.training.replays.recording import Recording, record

FORMATS = (".html", ".gif")


def replay(
    run: str | Path | None = None,
    row: int | None = None,
    scenario: Any = None,
    attack: Any = None,
    defense: Any = None,
    beside: Any = None,
    seed: int = 0,
    world: int = 0,
    out: str | Path | None = None,
    data: str | Path | None = None,
    max_cycles: int | None = None,
    overrides: Mapping[str, Any] | None = None,
) -> list[Recording]:
    """Play an episode again, and write what it shows to a page (.html) or a moving image (.gif).

    Either run and row: the folder of an evaluation and a row of its results.parquet, from 0, whose metrics must come
    out to the bit; attack and defense are then needed only where they are the user's own code or objects. Or scenario
    (default "patrol"), attack ("honest"), defense ("trust"), seed, world, max_cycles and overrides, as `evaluate` takes
    them. beside: another defense, to look at on the same episode. data: the recorded trajectories. A GIF needs
    pygame-ce and Pillow, the extras `render` and `plot`.

    Raises ValueError for what cannot be played and for a row whose metrics come out otherwise.
    """
    file = None if out is None else _checked_file(expanded(out))
    described = {"scenario": scenario, "max_cycles": max_cycles, "overrides": overrides}
    if run is None:
        episodes = _described(described, attack, defense, beside, seed, world, data)
    else:
        episodes = _of_run(Run(run, data), row, described, attack, defense, beside)
    recordings = [record(episode) for episode in episodes]
    if file is not None and file.suffix.lower() == ".gif":
        save_gif(file, episodes)
    elif file is not None:
        save_page(file, replay_page(recordings))
    return recordings


def replay_page(recordings: Sequence[Recording]) -> str:
    """A page that plays recordings of one episode side by side."""
    definitions = {name: metric.definition for name, metric in METRICS.items()}
    found = [recording.to_dict() for recording in recordings]
    return render("replays/replay.html.j2", recordings=found, definitions=definitions)


def _checked_file(file: Path) -> Path:
    if file.suffix.lower() not in FORMATS:
        raise ValueError(f"out = {str(file)!r}: expected a name that ends in {' or '.join(FORMATS)}")
    return file


def _of_run(
    run: Run, row: int | None, described: Mapping[str, Any], attack: Any, defense: Any, beside: Any
) -> list[Episode]:
    given = [name for name, value in described.items() if value]
    if given:
        raise ValueError(f"{given[0]}: {run.path} says that; expected a run, or a scenario")
    if row is None:
        raise ValueError(f"row: expected a row of {run.path}, from 0 to {run.table.num_rows - 1}")
    episode = run.episode(row, attack, defense)
    if beside is None:
        return [episode]
    (named,) = named_specs("defense", [beside], build_defense)
    same = run.row_of(episode.attack, named.name, episode.world)
    if same is not None:
        return [episode, run.episode(same, episode.policy, beside)]
    return [episode, changed(episode, defense=named.name, judge=named.construct(), metrics={})]


def _described(
    described: Mapping[str, Any], attack: Any, defense: Any, beside: Any, seed: int, world: int, data: Any
) -> list[Episode]:
    (policy,) = named_specs("attack", [attack or "honest"], build_policy)
    judges = named_specs("defense", [d for d in (defense or "trust", beside) if d is not None], build_defense)
    given = {} if data is None else {"targets.data": data}
    setting = load_scenario(described["scenario"] or "patrol", **given, **(described["overrides"] or {}))
    setting = load_scenario(setting, knowledge=sufficient_knowledge(setting, policy.construct()))
    horizon = described["max_cycles"]
    frames = setting.horizon if horizon is None else positive_int("max_cycles", horizon)
    first = Episode(
        setting, policy.name, "", policy.construct(), None, checked_seed(seed), world, frames, metrics={}
    )  # fmt: skip
    return [changed(first, defense=judge.name, judge=judge.construct()) for judge in judges]
