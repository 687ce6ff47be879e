"""Tables that are printed on request: strata, and how well trust is calibrated."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from trust_env.metrics.strata import Stratum
from trust_env.training.console import format_number, print_table
from trust_env.training.evaluation.results import Results

_KEYS = ("adversaries", "benign")
_BINS = ("count", "mean_forecast", "share_true")


def print_strata(results: Results, console: Console) -> None:
    """Damage and trust by who watches: a table for every cell."""
    for cell in results.cells:
        columns = [name.replace("_", " ") for name in Stratum._fields if name not in _KEYS]
        table = Table("adver-\nsaries", "benign", *columns, title=Text(f"{cell.attack} x {cell.defense}"))
        for column in table.columns:
            column.justify = "right"
        for stratum in cell.strata:
            values = [value for name, value in stratum._asdict().items() if name not in _KEYS]
            table.add_row(str(stratum.adversaries), str(stratum.benign), *map(_text, values))
        print_table(console, table)
    console.print(
        "by the number of adversaries, from their first edit on, and of benign agents whose FOV holds the track or the "
        "target; means over all frames of all episodes, so that the parts of damage add up to the cell's"
    )


def print_reliability(results: Results, console: Console) -> None:
    """Pooled Brier scores and calibration errors of trust, of every cell and of all attacks on a defense."""
    table = Table("attack", "defense", "trust in", "forecasts", "Brier score", "calibration error")
    for attack, defense, kind, found in _pooled(results):
        scores = [_text(found["brier"]), _text(found["calibration_error"])]
        table.add_row(Text(attack), Text(defense), kind, f"{found['forecasts']}", *scores)
    print_table(console, table)
    for attack, defense, kind, found in _pooled(results):
        if attack == _ALL:
            print_table(console, _bins_table(f"{defense}, {kind}, {_ALL}", found))
    console.print("pooled: every track or agent and frame counts once; –: no forecast")


_ALL = "all attacks"


def _pooled(results: Results) -> Iterator[tuple[str, str, str, Mapping[str, Any]]]:
    """Attack, defense, what is trusted, and what `pool` found, of all cells and then of all attacks on a defense."""
    found = results.to_dict()
    rows = [(cell["attack"], cell["defense"], cell["pooled"]) for cell in found["cells"]]
    rows += [(_ALL, pooled["defense"], pooled) for pooled in found["pooled"]]
    for attack, defense, pooled in rows:
        for kind in ("track_trust", "agent_trust"):
            if kind in pooled:
                yield attack, defense, kind.partition("_")[0] + "s", pooled[kind]


def _bins_table(title: str, found: Mapping[str, Any]) -> Table:
    table = Table("trust", *[name.replace("_", " ") for name in _BINS], title=Text(title))
    width = 1.0 / len(found["count"])
    for b, values in enumerate(zip(*(found[name] for name in _BINS))):
        table.add_row(f"{b * width:.1f}–{(b + 1) * width:.1f}", str(values[0]), *map(_text, values[1:]))
    return table


def _text(value: float | None) -> str:
    return "–" if value is None or math.isnan(value) else format_number(value)
