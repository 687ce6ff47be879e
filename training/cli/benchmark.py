"""Command line: benchmark."""

from __future__ import annotations

from typing import Annotated

from tyro.conf import arg

from trust_env.training.cli.options import CHECK_FAILED, OK, Json, print_report


def benchmark(
    quick: Annotated[bool, arg(help="shorter turns, and no compiling: some ten seconds instead of minutes")] = False,
    as_json: Json = False,
) -> int:
    """Speed, as ratios to peers timed in the same run. Exit code 1: a ratio is below what is wanted."""
    from trust_env.training.speed.benchmark import benchmark as run

    report = run(quick)
    print_report(report, as_json)
    return OK if report.ok else CHECK_FAILED
