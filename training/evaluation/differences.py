"""Defenses compared with one of them, attack by attack, on the same episodes."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from trust_env.errors import unknown_name
from trust_env.training.console import format_number, print_table
from trust_env.training.evaluation.results import DAMAGE, Results
from trust_env.training.evaluation.statistics import Bounds, simultaneous


class Difference(NamedTuple):
    """One attack: mean damage under a defense less that under another, and the former as a multiple of the latter.

    difference: with an interval that holds for all rows of the comparison at once, with 95 % probability.
    """

    attack: str
    defense: str
    difference: Bounds
    damage: float
    reference: float

    @property
    def ratio(self) -> float:
        """Infinite where the other defense lets nothing happen."""
        return self.damage / self.reference if self.reference > 0.0 else math.inf

    def to_dict(self) -> dict[str, Any]:
        """Plain values only."""
        names = {"attack": self.attack, "defense": self.defense, "damage": self.damage, "reference": self.reference}
        ratio = self.ratio if math.isfinite(self.ratio) else None
        return names | {"ratio": ratio, "difference": self.difference._asdict()}


def differences(results: Results, against: str) -> list[Difference]:
    """Mean damage of every cell less that of the same attack on the defense `against`, by paired episodes.

    The intervals hold for all rows at once (max-statistic bootstrap). ValueError: no such defense, or no other.
    """
    reference = reference_name(results, against)
    cells = [cell for cell in results.cells if cell.defense != reference]
    if not cells:
        raise ValueError(f"there is no other defense than {against} to compare with it; expected two or more")
    pairs = [(cell.metrics[DAMAGE], results[cell.attack, reference].metrics[DAMAGE]) for cell in cells]
    bounds = simultaneous([mine - its for mine, its in pairs])
    return [
        Difference(cell.attack, cell.defense, bound, float(np.mean(mine)), float(np.mean(its)))
        for cell, bound, (mine, its) in zip(cells, bounds, pairs, strict=True)
    ]


def reference_name(results: Results, against: str) -> str:
    """The full name of a defense. ValueError: no such defense."""
    try:
        return results[results.cells[0].attack, against].defense
    except ValueError:
        raise unknown_name("defense of this evaluation", against, {c.defense for c in results.cells}) from None


def print_differences(results: Results, against: str, console: Console) -> None:
    """A row for every attack and defense."""
    headings = ("damage", f"of {against}", "ratio", "difference", "interval")
    table = Table("attack", "defense", *headings, title=Text(f"Mean damage against that of {against}"))
    for column in table.columns[2:]:
        column.justify = "right"
    above = ""
    for row in differences(results, against):
        table.add_section() if above not in ("", row.attack) else None
        numbers = (row.damage, row.reference, row.ratio, row.difference.value)
        interval = f"{row.difference.low:+.3f} to {row.difference.high:+.3f}"
        texts = [*(format_number(n) if math.isfinite(n) else "–" for n in numbers), interval]
        table.add_row(Text(row.attack if row.attack != above else ""), Text(row.defense), *texts)
        above = row.attack
    print_table(console, table)
    console.print("by paired episodes; the intervals hold for all rows at once with 95 % probability")
