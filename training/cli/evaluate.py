"""Command line: evaluate."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from trust_env.training.cli.options import (
    Data,
    Json,
    Knowledge,
    Repeated,
    Scenario,
    Seed,
    fields_of,
    print_json,
)


def evaluate(
    scenario: Scenario = "patrol",
    attack: Annotated[str, arg(help="attacks, separated by commas: honest,false_positive(n=2)")] = "honest",
    defense: Annotated[str, arg(help="defenses: score,trust(preset=cdc2024),my_file.py:MyDefense")] = "trust",
    episodes: Annotated[int, arg(help="episodes per cell, the same ones in all cells")] = 50,
    seed: Seed = 0,
    out: Annotated[Path | None, arg(help="folder for results.parquet and results.json, new or empty")] = None,
    resume: Annotated[bool, arg(help="continue the unfinished run in --out")] = False,
    knowledge: Knowledge = None,
    actuation: Annotated[
        Literal["monitor", "filter", "remove", "weight", "retro"] | None, arg(help="what a verdict does")
    ] = None,
    data: Data = None,
    max_cycles: Annotated[int | None, arg(help="frames per episode, in place of the scenario's horizon")] = None,
    settings: Annotated[
        Repeated,
        arg(
            name="set",
            metavar="FIELD=VALUE",
            help="set a field of the scenario, as in tracker.gate=0.95; repeatable",
        ),
    ] = (),
    metric: Annotated[str | None, arg(help="metrics, separated by commas, or all; default: an overview")] = None,
    strata: Annotated[bool, arg(help="also print damage and trust by who watches a track or target")] = False,
    reliability: Annotated[bool, arg(help="also print pooled Brier scores and calibration of trust")] = False,
    against: Annotated[str | None, arg(help="also print how the damage differs from that of this defense")] = None,
    as_json: Json = False,
) -> None:
    """Play attacks against defenses on the same episodes; tables, results.parquet and results.json."""
    from rich.console import Console

    from trust_env.training.evaluation.detail_tables import print_reliability, print_strata
    from trust_env.training.evaluation.differences import differences, print_differences
    from trust_env.training.evaluation.evaluate import evaluate as run
    from trust_env.training.evaluation.overview import print_overview
    from trust_env.training.evaluation.tables import chosen_metrics, print_results

    metrics = None if metric is None else chosen_metrics(metric)
    if resume and out is None:
        raise ValueError("--resume: expected --out too, the folder of the run to continue")
    options = {"knowledge": knowledge, "data": data, "actuation": actuation, "max_cycles": max_cycles}
    overrides = fields_of(settings)
    try:
        results = run(scenario, attack, defense, episodes, seed, out, resume, **options, overrides=overrides)
    except (KeyboardInterrupt, OSError):
        if out is not None and (out / "results.parquet").is_file():
            print(f"trust-env: the finished cells are in {out}; --resume continues", file=sys.stderr)
        raise
    if as_json:
        compared = {} if against is None else {"against": [row.to_dict() for row in differences(results, against)]}
        print_json(results.to_dict() | compared)
        for note in results.notes:
            print(f"trust-env: {note}", file=sys.stderr)
    else:
        if metrics is None:
            print_overview(results, Console(), out)
        else:
            print_results(results, metrics, Console())
        if strata:
            print_strata(results, Console())
        if reliability:
            print_reliability(results, Console())
        if against is not None:
            print_differences(results, against, Console())
