"""Command line: report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from trust_env.training.cli.options import Json, print_json


def report(
    runs: Annotated[Positional[tuple[Path, ...]], arg(help="folders of evaluate, exploit, curve, rank and train")],
    out: Annotated[Path, arg(help="file to write")] = Path("report.html"),
    against: Annotated[str | None, arg(help="the defense to compare with; default: score, else the first")] = None,
    replays: Annotated[int, arg(help="cells whose worst, median and best episode the page plays, 12 at most")] = 4,
    attack: Annotated[str | None, arg(help="code of yours among the runs' attacks, to be played, with commas")] = None,
    defense: Annotated[str | None, arg(help="code of yours among their defenses, to be played")] = None,
    as_json: Json = False,
) -> None:
    """Write a page on runs: damage, differences, courses, calibration, curves, replays; it works offline."""
    from trust_env.training.reports.report import report as write

    found = write(runs, out, against, replays, attack or (), defense or ())
    size = out.stat().st_size
    if as_json:
        names = [{"kind": section["kind"], "name": section["name"]} for section in found["sections"]]
        played = [replay["label"] for replay in found["replays"]]
        told = {"sections": names, "replays": played, "left_out": found["left_out"]}
        print_json({"out": str(out), "bytes": size, **told})
        return
    for text in found["left_out"]:
        print(f"not replayed: {text}")
    print(f"{out}: {size / 1e6:.1f} MB, {len(found['replays'])} replays; open it in a browser")
