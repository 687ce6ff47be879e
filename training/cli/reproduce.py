"""Command line: reproduce."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from trust_env.training.cli.options import CHECK_FAILED, OK, Json, print_report


def reproduce(
    out: Annotated[
        Path | None, arg(help="folder for the figures; by default results/paper, or none without matplotlib")
    ] = None,
    seeds: Annotated[int, arg(help="worlds whose mean stands for a panel")] = 64,
    as_json: Json = False,
) -> int:
    """The paper's Theorem 1 and trust panels, ours beside the published numbers. Exit code 1: they differ."""
    from trust_env.training.paper.reproduce import reproduce as run

    report = run(_default_folder() if out is None else out, seeds)
    print_report(report, as_json)
    return OK if report.ok else CHECK_FAILED


def _default_folder() -> Path | None:
    """results/paper; None, and a line on stderr, without matplotlib."""
    from importlib.util import find_spec

    if find_spec("matplotlib") is not None:
        return Path("results/paper")
    print("trust-env: no figures, as matplotlib is missing: pip install 'trust-env[plot]'", file=sys.stderr)
    return None
