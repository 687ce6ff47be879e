"""Command line: rank."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from trust_env.training.cli.options import CHECK_FAILED, OK, Json, Repeated, print_report


def rank(
    quick: Annotated[bool, arg(help="the version's list of attacks against every defense: minutes")] = False,
    full: Annotated[bool, arg(help="search and training against every defense: hours; needs --out")] = False,
    search: Annotated[bool, arg(help="tune the version's attacks, for --quick to play; needs --out")] = False,
    check: Annotated[Path | None, arg(help="JSON of a quick ranking to play again and compare")] = None,
    defense: Annotated[str | None, arg(help="defenses that join, with commas: my_file.py:Mine")] = None,
    attack: Annotated[str | None, arg(help="attacks that join, with commas: their_file.py:Theirs")] = None,
    entry: Annotated[Repeated, arg(metavar="FOLDER", help="folder with an entry.yaml that joins; repeatable")] = (),
    only: Annotated[str | None, arg(help="of the defenses just these, with commas")] = None,
    scenario: Annotated[str | None, arg(help="of the version's scenarios just these, with commas")] = None,
    threat: Annotated[str | None, arg(help="of the version's threat models just these, with commas")] = None,
    version: Annotated[str, arg(help="number of the protocol, or a YAML file like that of a version")] = "1",
    out: Annotated[Path | None, arg(help="folder for the JSON, the tables and all parts, new or empty")] = None,
    resume: Annotated[bool, arg(help="continue what was begun in --out")] = False,
    as_json: Json = False,
) -> int:
    """Rank all defenses by the worst attack's damage, quick or full; tune attacks for it; check a published ranking."""
    from trust_env.training.ranking.entry import load_entry
    from trust_env.training.ranking.rank import check as run_check
    from trust_env.training.ranking.rank import rank as run
    from trust_env.training.ranking.searching import search_attacks

    if (quick, full, search, check is not None).count(True) != 1:
        raise ValueError("rank: expected one of --quick, --full, --search and --check FILE")
    if resume and out is None:
        raise ValueError("--resume: expected --out too, the folder of the ranking to continue")
    if check is not None:
        outcome = run_check(check, only or ())
        print_report(outcome, as_json)
        return CHECK_FAILED if outcome.differences else OK
    if search:
        if defense or attack or entry or only or scenario or threat:
            raise ValueError("--search: expected --version, --out and --resume only: it is of a whole version")
        print_report(search_attacks(version, out, resume), as_json)
        return OK
    entries = [load_entry(folder) for folder in entry]
    defenses = [defense or "", *(text for one in entries for text in one.defenses)]
    attacks = [attack or "", *(text for one in entries for text in one.attacks)]
    found = run(
        "quick" if quick else "full", ",".join(filter(None, defenses)), ",".join(filter(None, attacks)), only or (),
        scenario or (), threat or (), version, out, resume,
    )  # fmt: skip
    print_report(found, as_json)
    return OK
