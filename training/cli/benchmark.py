"""Command line: benchmark."""

from __future__ import annotations

from typing import Annotated

from tyro.conf import arg

from trust_env.training.cli.options import Json, print_report


def benchmark(
    quick: Annotated[bool, arg(help="shorter turns, and no compiling: some ten seconds instead of minutes")] = False,
    as_json: Json = False,
) -> None:
    """Speed, as ratios to peers timed in the same run, beside what is wanted."""
    from trust_env.training.speed.benchmark import benchmark as run

    print_report(run(quick), as_json)
