"""Command line: demo."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from trust_env.training.cli.options import Json, print_json

ATTACKS = ("false_positive", "learned(against=trust)")  # one that is scripted, one that was trained
DEFENSES = ("score", "majority", "trust")
PAGE, REPLAYED = "report.html", 2  # cells whose episodes the page plays
NEXT = (
    ("a defense of your own", "trust-env new defense my_defense"),
    ("what else there is to play", "trust-env attacks list; trust-env defenses list; trust-env scenarios list"),
    ("how bad it gets", 'trust-env evaluate --attack honest,by_turns,"learned(against=score)" --defense score,trust'),
)


def demo(
    out: Annotated[Path, arg(help="folder for the results; what is finished there is shown again")] = Path("demo"),
    episodes: Annotated[int, arg(help="episodes per cell")] = 20,
    as_json: Json = False,
) -> None:
    """The first minute: a scripted and a trained attack against three defenses, on the scenario patrol."""
    if not as_json:
        print(
            "Five agents track what moves about them; two of them attack.\n"
            f"{len(ATTACKS)} attacks ({', '.join(ATTACKS)})\nagainst {len(DEFENSES)} defenses ({', '.join(DEFENSES)}), "
            f"{episodes} episodes each.",
            flush=True,
        )
    from rich.console import Console

    from trust_env.training.evaluation.evaluate import evaluate
    from trust_env.training.evaluation.overview import print_overview
    from trust_env.training.evaluation.run_folder import ROWS
    from trust_env.training.reports.report import report as write_report

    results = evaluate("patrol", ATTACKS, DEFENSES, episodes, out=out, resume=(out / ROWS).is_file())
    if as_json:
        print_json(results.to_dict())
        return
    print_overview(results, Console(), out)
    page = out / PAGE
    write_report(out, page, cells=REPLAYED)
    print(f"\nthe same as a page with pictures and replays, to open in a browser:\n  {page}")
    print("\nto try next:")
    for what, command in NEXT:
        print(f"  {what}:\n    {command}")
