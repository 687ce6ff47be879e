"""Command line: curve."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from trust_env.training.cli.options import Data, Json, Knowledge, Repeated, Scenario, Seed, fields_of, print_json


def curve(
    over: Annotated[
        str, arg(help="adversaries, p_detect, clutter, spread, slots, or a field of the scenario, as tracker.fusion")
    ] = "adversaries",
    values: Annotated[str | None, arg(help="values of it, separated by commas; default: its own")] = None,
    scenario: Scenario = "patrol",
    attack: Annotated[str, arg(help="attacks, separated by commas")] = "false_positive",
    defense: Annotated[str, arg(help="defenses, separated by commas")] = "score,trust",
    episodes: Annotated[int, arg(help="episodes per cell, the same ones in all cells")] = 50,
    seed: Seed = 0,
    out: Annotated[Path | None, arg(help="folder for curve.json, curve.parquet, curve.png and the runs")] = None,
    resume: Annotated[bool, arg(help="continue in --out, with more values if you like")] = False,
    metric: Annotated[str, arg(help="what the curve shows; see metrics list")] = "damage_per_frame",
    knowledge: Knowledge = None,
    data: Data = None,
    settings: Annotated[Repeated, arg(name="set", metavar="FIELD=VALUE", help="set a field of the scenario")] = (),
    as_json: Json = False,
) -> None:
    """Attacks against defenses over a condition: table, curve.json, curve.parquet and a figure."""
    from rich.console import Console

    from trust_env.scenario.yaml_lines import read_yaml
    from trust_env.training.curves.curve import curve as run
    from trust_env.training.curves.table import print_curve

    if resume and out is None:
        raise ValueError("--resume: expected --out too, the folder of the curve to continue")
    chosen = None if values is None else read_yaml(f"values: [{values}]", f"--values {values}")[0]["values"]
    found = run(
        over, chosen, scenario, attack, defense, episodes, seed, out, resume, metric, knowledge, data,
        fields_of(settings),
    )  # fmt: skip
    if as_json:
        print_json(found.to_dict())
    else:
        print_curve(found, Console())
