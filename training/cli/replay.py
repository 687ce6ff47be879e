"""Command line: replay."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from trust_env.training.cli.options import Data, Repeated, ScenarioOrDefault, Seed, fields_of


def replay(
    run: Annotated[Positional[Path | None], arg(help="folder of an evaluation; without it, --scenario and so on")] = None,
    row: Annotated[int | None, arg(help="row of its results.parquet, from 0")] = None,
    scenario: ScenarioOrDefault = None,
    attack: Annotated[str | None, arg(help="attack, honest by default; of a run only where it is code of yours")] = None,
    defense: Annotated[str | None, arg(help="defense, trust by default; the same")] = None,
    beside: Annotated[str | None, arg(help="another defense, to see on the same episode")] = None,
    seed: Seed = 0,
    world: Annotated[int, arg(help="which of the seed's episodes, from 0")] = 0,
    out: Annotated[Path, arg(help="file to write: .html, a page that plays it, or .gif")] = Path("replay.html"),
    data: Data = None,
    max_cycles: Annotated[int | None, arg(help="frames, in place of the scenario's horizon")] = None,
    settings: Annotated[Repeated, arg(name="set", metavar="FIELD=VALUE", help="set a field of the scenario")] = (),
) -> None:
    """Play an episode again, of a run or as described, and write a page or a GIF that shows it."""
    from trust_env.training.replay.replay import replay as run_replay

    fields = fields_of(settings)
    recordings = run_replay(run, row, scenario, attack, defense, beside, seed, world, out, data, max_cycles, fields)
    for recording in recordings:
        episode, damage = recording.episode, recording.metrics["damage_per_frame"]
        checked = ", as in its row" if episode.metrics else ""
        print(
            f"{episode.scenario.name}, {episode.attack} x {episode.defense}, seed {episode.seed}, world {episode.world}: "
            f"damage per frame {damage:.3g}{checked}"
        )
    print(f"{out}: open it in a browser" if out.suffix.lower() == ".html" else str(out))
