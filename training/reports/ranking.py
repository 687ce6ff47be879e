"""What a report shows of a ranking: its rows, by scenario and threat model, as the files of `rank` have them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from trust_env.training.ranking.ranking import load_ranking
from trust_env.training.ranking.table import MEANING, command
from trust_env.training.reports.evaluation import shown

_FILES = ("quick.json", "full.json")
_HEADER = ("claim", "version", "environment", "package", "numpy", "processor")


def ranking_files(path: Path) -> list[Path]:
    """The rankings in a folder."""
    return [path / name for name in _FILES if (path / name).is_file()]


def ranking_section(file: Path) -> dict[str, Any]:
    """A ranking as plain values. ValueError: the file holds none."""
    found = load_ranking(file)
    try:
        groups = [_group(scenario, threat, rows) for scenario, threat, rows in found.groups()]
        header = {name: found.fields[name] for name in _HEADER}
        return {
            "kind": "ranking",
            "name": f"{file.parent.name}, {file.stem}",
            "folder": str(file.parent),
            "order": found.fields["kind"],
            "scenario": ", ".join(dict.fromkeys(group["scenario"] for group in groups)),
            "command": command(found.fields),
            "meaning": MEANING,
            "groups": groups,
            **header,
        }
    except (AttributeError, KeyError, TypeError) as fault:
        raise ValueError(f"{file}: not as this version writes it: {type(fault).__name__} {fault}") from None


def _group(scenario: str, threat: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The rows of a table, the least damage by the worst attack first, and the damage of attacks that all rows have."""
    attacks = [attack for attack in rows[0]["damage"] if all(attack in row["damage"] for row in rows)]
    return {
        "scenario": scenario,
        "threat": threat,
        "rows": [_row(row) for row in rows],
        "attacks": attacks,
        "damage": [[row["damage"][attack] for row in rows] for attack in attacks],
    }


def _row(row: Mapping[str, Any]) -> dict[str, Any]:
    worst = row["worst"]
    return {
        "defense": row["defense"],
        "reference": row["reference"],
        "attack": worst["attack"],
        "worst": worst["mean"],
        "worst_tenth": worst["worst_decile"],
        "placed": row["placed"],
        "mean": row["mean"],
        "honest": row["honest"]["mean"],
        "cells": list(_cells(row)),
    }


def _cells(row: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """The numbers of a row as they are shown, in the order of the page's columns."""
    worst, calibration = row["worst"], row["calibration"]
    for bounds in (worst["mean"], worst["worst_decile"], row["placed"], row["mean"], row["honest"]["mean"]):
        value, low, high = (None if bounds is None else bounds[name] for name in ("value", "low", "high"))
        interval = None if low is None or high is None else f"{shown(low)} to {shown(high)}"
        yield {"value": value, "text": shown(value), "interval": interval}
    errors = (calibration.get(kind, {}).get("calibration_error") for kind in ("track_trust", "agent_trust"))
    for value in (row["false_accusations"], *errors, row["time_ratio"]):
        yield {"value": value, "text": shown(value), "interval": None}
