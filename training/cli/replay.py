"""Command line: replay."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from trust_env.training.cli.options import Data, Json, Repeated, ScenarioOrDefault, Seed, fields_of, print_json


def replay(
    run: Annotated[Positional[Path | None], arg(help="folder of an evaluation; else --scenario etc.")] = None,
    row: Annotated[int | None, arg(help="row of its results.parquet, from 0")] = None,
    scenario: ScenarioOrDefault = None,
    attack: Annotated[str | None, arg(help="attack (honest); of a run only where it is your code")] = None,
    defense: Annotated[str | None, arg(help="defense (trust); the same")] = None,
    beside: Annotated[str | None, arg(help="another defense, to see on the same episode")] = None,
    seed: Seed = 0,
    world: Annotated[int, arg(help="which of the seed's episodes, from 0")] = 0,
    out: Annotated[Path, arg(help="file to write: .html, a page that plays it, or .gif")] = Path("replay.html"),
    data: Data = None,
    max_cycles: Annotated[int | None, arg(help="frames, in place of the scenario's horizon")] = None,
    settings: Annotated[Repeated, arg(name="set", metavar="FIELD=VALUE", help="set a field of the scenario")] = (),
    as_json: Json = False,
) -> None:
    """Play an episode again, of a run or as described, and write a page or a GIF that shows it."""
    from trust_env.training.replays.replay import replay as run_replay

    fields = fields_of(settings)
    recordings = run_replay(run, row, scenario, attack, defense, beside, seed, world, out, data, max_cycles, fields)
    if as_json:
        print_json([{**recording.summary(), "out": str(out)} for recording in recordings])
        return
    for recording in recordings:
        episode, damage = recording.episode, recording.metrics["damage_per_frame"]
        checked = ", as in its row" if episode.metrics else ""
        name = f"{episode.scenario.name}, {episode.attack} x {episode.defense}"
        print(f"{name}, seed {episode.seed}, world {episode.world}: damage per frame {damage:.3g}{checked}")
    print(f"{out}: open it in a browser" if out.suffix.lower() == ".html" else str(out))
