"""The commands that compute."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

from tyro.conf import UseAppendAction, arg

from trust_env.training.cli import learning as learning_commands

Json = Annotated[bool, arg(name="json", help="print JSON instead of tables")]
Data = Annotated[Path | None, arg(help="CSV file of recorded trajectories (targets.data)")]
Seed = Annotated[int, arg(help="seed of all random numbers")]
Scenario = Annotated[str, arg(help="name, name(field=value, ...), or a YAML file")]
Settings = UseAppendAction[
    Annotated[
        tuple[str, ...],
        arg(
            name="set",
            metavar="FIELD=VALUE",
            help="set a field of the scenario, as in tracker.gate=0.95; repeatable",
        ),
    ]
]


def evaluate(
    scenario: Scenario = "patrol",
    attack: Annotated[str, arg(help="attacks, separated by commas: honest,false_positive(n=2)")] = "honest",
    defense: Annotated[str, arg(help="defenses: score,trust(preset=cdc2024),my_file.py:MyDefense")] = "trust",
    episodes: Annotated[int, arg(help="episodes per cell, the same ones in all cells")] = 50,
    seed: Seed = 0,
    out: Annotated[Path | None, arg(help="folder for results.parquet and results.json, new or empty")] = None,
    resume: Annotated[bool, arg(help="continue the unfinished run in --out")] = False,
    knowledge: Annotated[
        Literal["own", "poses", "picture", "white_box"] | None, arg(help="what agents observe")
    ] = None,
    actuation: Annotated[
        Literal["monitor", "filter", "remove", "weight"] | None, arg(help="what a verdict does")
    ] = None,
    data: Data = None,
    max_cycles: Annotated[
        int | None, arg(help="frames per episode, in place of the scenario's horizon")
    ] = None,
    settings: Settings = (),
    metric: Annotated[str | None, arg(help="metrics of the table, separated by commas, or all")] = None,
    as_json: Json = False,
) -> int:
    """Play attacks against defenses on the same episodes; tables, results.parquet and results.json."""
    from rich.console import Console

    from trust_env.metrics import METRICS
    from trust_env.training.evaluation.evaluate import evaluate as run
    from trust_env.training.evaluation.results import checked_metrics
    from trust_env.training.evaluation.tables import HEADLINES, print_results

    names = list(
        METRICS if metric == "all" else HEADLINES if metric is None else checked_metrics(metric.split(","))
    )
    if resume and out is None:
        raise ValueError("--resume: expected --out too, the folder of the run to continue")
    try:
        results = run(
            scenario,
            attack,
            defense,
            episodes,
            seed,
            out=out,
            resume=resume,
            knowledge=knowledge,
            data=data,
            actuation=actuation,
            max_cycles=max_cycles,
            overrides=settings_of(settings),
        )
    except (KeyboardInterrupt, OSError):
        if out is not None and (out / "results.parquet").is_file():
            print(f"trust-env: the finished cells are in {out}; --resume continues", file=sys.stderr)
        raise
    if as_json:
        print(json.dumps(results.to_dict(), indent=2, allow_nan=False))
        for note in results.notes:
            print(f"trust-env: {note}", file=sys.stderr)
    else:
        print_results(results, names, Console())
    return 0


def conform(
    scenario: Annotated[str | None, arg(help="scenarios, separated by commas; default: all built in")] = None,
    defense: Annotated[str | None, arg(help="defenses, separated by commas; default: all built in")] = None,
    env: Annotated[str | None, arg(help="my_file.py:make_env, a ParallelEnv of your own, instead")] = None,
    attack: Annotated[
        str | None, arg(help="who plays the adversaries; default: random actions of all")
    ] = None,
    data: Data = None,
    seed: Seed = 0,
    max_seconds: Annotated[float, arg(help="follow an episode for at most this long")] = 5.0,
    as_json: Json = False,
) -> int:
    """Check environments: PettingZoo's tests by name, determinism, copies, memory. Exit code 1: a failure."""
    from rich.console import Console

    from trust_env.training.evaluation.conform import conform as run

    found = run(scenario, defense, env, attack, data, seed, max_seconds)
    if as_json:
        print(json.dumps(found.to_dict(), indent=2))
    else:
        found.print(Console())
    return 0 if found.ok else 1


def reproduce(
    out: Annotated[
        Path | None, arg(help="folder for the figures; by default results/paper, or none without matplotlib")
    ] = None,
    seeds: Annotated[int, arg(help="worlds whose mean stands for a panel")] = 64,
    as_json: Json = False,
) -> int:
    """The paper's Theorem 1 and trust panels, ours beside the published numbers. Exit code 1: they differ."""
    from importlib.util import find_spec

    from rich.console import Console

    from trust_env.training.paper.reproduce import reproduce as run

    if out is None and find_spec("matplotlib") is not None:
        out = Path("results/paper")
    elif out is None:
        print(
            "trust-env: no figures, as matplotlib is missing: pip install 'trust-env[plot]'", file=sys.stderr
        )
    report = run(out, seeds)
    if as_json:
        print(json.dumps(report.to_dict(), indent=2, allow_nan=False))
    else:
        report.print(Console())
    return 0 if report.ok else 1


def benchmark(
    quick: Annotated[
        bool, arg(help="shorter turns, and no compiling: some ten seconds instead of minutes")
    ] = False,
    as_json: Json = False,
) -> int:
    """Speed, as ratios to peers timed in the same run. Exit code 1: a ratio is below what is wanted."""
    from rich.console import Console

    from trust_env.training.speed.benchmark import benchmark as run

    timings = run(quick)
    if as_json:
        print(json.dumps(timings.to_dict(), indent=2, allow_nan=False))
    else:
        timings.print(Console())
    return 0 if timings.ok else 1


def settings_of(texts: tuple[str, ...]) -> dict[str, Any]:
    """{"tracker.gate": 0.95} from tracker.gate=0.95, values read as YAML."""
    from trust_env.scenario.yaml_lines import read_yaml

    found: dict[str, Any] = {}
    for text in texts:
        field, equals, value = text.partition("=")
        if not (equals and field.strip()):
            raise ValueError(f"--set {text}: expected FIELD=VALUE, such as tracker.gate=0.95")
        if field.strip() in found:
            raise ValueError(f"--set {text}: {field.strip()} is given twice")
        found[field.strip()] = read_yaml(f"value: {value}", f"--set {text}")[0]["value"]
    return found


COMMANDS: dict[str, Callable[..., int | None]] = {
    "evaluate": evaluate,
    "reproduce": reproduce,
    "conform": conform,
    "benchmark": benchmark,
    "train": learning_commands.train,
    "exploit": learning_commands.exploit,
}
