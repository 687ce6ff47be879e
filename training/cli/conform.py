"""Command line: conform."""

from __future__ import annotations

from typing import Annotated

from tyro.conf import arg

from trust_env.training.cli.options import CHECK_FAILED, OK, Data, Json, Seed, print_report


def conform(
    scenario: Annotated[str | None, arg(help="scenarios, separated by commas; default: all built in")] = None,
    defense: Annotated[str | None, arg(help="defenses, separated by commas; default: all built in")] = None,
    env: Annotated[str | None, arg(help="my_file.py:make_env, a ParallelEnv of your own, instead")] = None,
    attack: Annotated[str | None, arg(help="who plays the adversaries; default: random actions of all")] = None,
    data: Data = None,
    seed: Seed = 0,
    max_seconds: Annotated[float, arg(help="follow an episode for at most this long")] = 5.0,
    as_json: Json = False,
) -> int:
    """Check environments: PettingZoo's tests by name, determinism, copies, memory. Exit code 1: a failure."""
    from trust_env.training.evaluation.conform import conform as run

    report = run(scenario, defense, env, attack, data, seed, max_seconds)
    print_report(report, as_json)
    return OK if report.ok else CHECK_FAILED
