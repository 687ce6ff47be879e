"""A full ranking in short: what each defense shows wrong without an attack, and under the worst one.

python -m trust_env.training.published.ranking_summary rankings/v1/full.json
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import tyro

from trust_env.training.console import format_number
from trust_env.training.published.rows import markdown
from trust_env.training.ranking.ranking import Ranking, load_ranking

COLUMNS = ("no attack", "worst found", "by")  # of each scenario


def summary(ranking: Ranking) -> list[str]:
    """The lines of a Markdown table, from the least damage in the first scenario to the most."""
    scenarios = list(dict.fromkeys(row["scenario"] for row in ranking.rows))
    by_place = {(row["defense"], row["scenario"]): row for row in ranking.rows}
    _, _, ordered = next(ranking.groups())
    columns = [f"{scenario}: {column}" for scenario in scenarios for column in COLUMNS]
    lines = [
        [f"`{name}`", *(cell for scenario in scenarios for cell in _cells(by_place[name, scenario]))]
        for name in (row["defense"] for row in ordered)
    ]
    return markdown(("defense", *columns), lines)


def _cells(row: dict[str, Any]) -> list[str]:
    worst = row["worst"]
    damage = [format_number(outcome["mean"]["value"]) for outcome in (row["honest"], worst)]
    return [*damage, f"`{worst['attack'].partition('(')[0].partition(',')[0]}`"]


def show(file: Annotated[Path, tyro.conf.Positional] = Path("rankings/v1/full.json")) -> None:
    """Print the table. ValueError: the file holds no ranking."""
    print("\n".join(summary(load_ranking(file))))


if __name__ == "__main__":
    tyro.cli(show)
