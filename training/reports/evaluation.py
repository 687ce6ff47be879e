"""What a report shows of an evaluation: its numbers as results.json has them, and its episodes and frames, packed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from trust_env.metrics import METRICS
from trust_env.metrics.agent_record import N_SCORES
from trust_env.metrics.course_record import COURSES
from trust_env.training.console import format_number
from trust_env.training.evaluation.details import STATISTICS, Details
from trust_env.training.evaluation.differences import Difference, differences, reference_name
from trust_env.training.evaluation.results import DAMAGE, REFERENCES, Results, cells_of
from trust_env.training.evaluation.run_folder import SUMMARY, read_details, read_run
from trust_env.training.evaluation.statistics import mean_intervals
from trust_env.training.pages.packing import pack

COLUMNS = {  # metric, and what of its summary, by heading
    "damage": (DAMAGE, "mean"),
    "worst tenth": (DAMAGE, "worst_decile"),
    "false": ("false_tracks_per_frame", "mean"),
    "injected": ("injected_tracks_per_frame", "mean"),
    "missing": ("missing_targets_per_frame", "mean"),
    "AUROC": ("adversary_auroc", "mean"),
    "accused": ("accusation_rate", "mean"),
    "falsely accused": ("false_accusation_rate", "mean"),
}
_PROGRAM = ("trust-env", "trust_env/training/cli/__main__.py")


class Evaluation:
    """The folder of an evaluation: the cells that both results.parquet and results.json hold, as a run that was broken
    off may have written a cell to the first only. Raises ValueError for a folder that is none, or without such a cell.

    first_row: of results.parquet, by cell.
    """

    def __init__(self, path: Path):
        self.path = path
        table, self.configuration, strata = read_run(path)
        self.details, self.command = read_details(path)
        self.written = json.loads((path / SUMMARY).read_text(encoding="utf-8"))
        c, found = self.configuration, {cell.key: cell for cell in cells_of(table, strata)}
        self.first_row = {key: number * c["episodes"] for number, key in enumerate(found)}
        self.summaries = {(s["attack"], s["defense"]): s for s in self.written["cells"]}
        both = tuple(cell for key, cell in found.items() if key in self.summaries)
        if not both:
            raise ValueError(f"{path}: no cell is finished; expected at least one")
        self.results = Results(self.written["scenario"], c["seed"], c["episodes"], c["version"], both)

    @property
    def missing(self) -> int:
        """How many cells are not finished."""
        planned = len(self.configuration["attacks"]) * len(self.configuration["defenses"])
        return planned - len(self.results.cells)

    def section(self, against: str | None) -> dict[str, Any]:
        """Plain values only; against: the defense that all others are compared with, the first by default."""
        cells, configuration = self.results.cells, self.configuration
        return {
            "kind": "evaluation",
            "name": self.path.name,
            "folder": str(self.path),
            "scenario": self.written["scenario"],
            "knowledge": configuration["scenario"]["knowledge"],
            "actuation": configuration["scenario"]["actuation"],
            "seed": configuration["seed"],
            "episodes": configuration["episodes"],
            "horizon": configuration["horizon"],
            "version": configuration["version"],
            "package": configuration["package"],
            "command": tidied(self.command),
            "fields": configuration["scenario"],
            "missing": self.missing,
            "attacks": list(dict.fromkeys(cell.attack for cell in cells)),
            "defenses": list(dict.fromkeys(cell.defense for cell in cells)),
            "columns": {heading: _definition(*column) for heading, column in COLUMNS.items()},
            "cells": [_cell(self.summaries[cell.key]) for cell in cells],
            "references": sorted({cell.defense for cell in cells if is_reference(cell.defense)}),
            "glance": self._glance(),
            "compared": self._compared(against),
            "has_courses": all(cell.key in self.details for cell in cells),
            "packed": pack(self._arrays()),
        }

    def _glance(self) -> list[dict[str, Any]]:
        """Every defense with its damage under all attacks together and under the worst of them, the best first."""
        found = []
        for defense in dict.fromkeys(cell.defense for cell in self.results.cells):
            means = {c.attack: float(c.metrics[DAMAGE].mean()) for c in self.results.cells if c.defense == defense}
            worst = max(means, key=means.__getitem__)
            mean = sum(means.values()) / len(means)
            found.append({"defense": defense, "mean": mean, "attack": worst, "worst": means[worst]})
        return sorted(found, key=lambda row: row["worst"])

    def reference(self, against: str | None) -> str | None:
        """The name of the defense that all others are compared with; None where there is no other.

        ValueError: there is none of that name.
        """
        defenses = list(dict.fromkeys(cell.defense for cell in self.results.cells))
        if len(defenses) < 2:
            return None
        if against is None:
            return next((d for d in defenses if d.partition("(")[0] == "score"), defenses[0])
        return reference_name(self.results, against)

    def _compared(self, against: str | None) -> dict[str, Any] | None:
        """Differences from a defense; None where there is no other."""
        chosen = self.reference(against)
        if chosen is None:
            return None
        rows = [(row, self._less(row, chosen)) for row in differences(self.results, chosen)]
        shares = mean_intervals({str(number): less for number, (_, less) in enumerate(rows)})
        found = [row.to_dict() | {"less": shares[str(n)][0]._asdict()} for n, (row, _) in enumerate(rows)]
        return {"against": chosen, "rows": found}

    def _less(self, row: Difference, against: str) -> np.ndarray:
        """Whether an episode has less damage than under the defense compared with: 1, 0, or 1/2 for as much."""
        mine, other = (self.results[row.attack, defense].metrics[DAMAGE] for defense in (row.defense, against))
        return (mine < other) + 0.5 * (mine == other)

    def _arrays(self) -> dict[str, np.ndarray]:
        """Damage of every cell and episode; and of every cell and frame mean, 10 % and 90 % quantile of `COURSES`."""
        cells = self.results.cells
        arrays = {"damage": np.stack([cell.metrics[DAMAGE] for cell in cells])}
        nothing = Details(dict.fromkeys(COURSES, np.empty((0, len(STATISTICS)))), np.zeros((2, N_SCORES), int))
        details = [self.details.get(cell.key, nothing) for cell in cells]
        for name in COURSES:
            for column, statistic in enumerate(STATISTICS):
                if statistic != "q50":
                    arrays[f"{name}_{statistic}"] = np.concatenate([each.courses[name][:, column] for each in details])
        return arrays | {"scores": np.stack([each.scores for each in details])}


def _cell(written: Mapping[str, Any]) -> dict[str, Any]:
    """A row of the table, with the numbers of results.json and how they are shown; and trust pooled in tenths."""
    values = []
    for heading, (metric, statistic) in COLUMNS.items():
        summary = written["metrics"].get(metric) or {}
        value, bounds = summary.get(statistic), (summary.get("mean_low"), summary.get("mean_high"))
        interval = bounds if heading == "damage" and None not in bounds else None
        values.append({"heading": heading, "value": value, "text": shown(value), "interval": interval})
    damage = written["metrics"][DAMAGE]
    return {
        "attack": written["attack"],
        "defense": written["defense"],
        "values": values,
        "damage": [damage["mean"], damage["mean_low"], damage["mean_high"]],
        "pooled": written["pooled"],
    }


def _definition(metric: str, statistic: str) -> str:
    text = METRICS[metric].definition
    return text if statistic == "mean" else f"mean of the worst tenth of the episodes: {text}"


def is_reference(defense: str) -> bool:
    """Whether a defense is there to compare with only."""
    return defense.partition("(")[0] in REFERENCES


def tidied(command: str) -> str:
    """A command line with the program's name in place of its file."""
    program, _, arguments = command.partition(" ")
    return f"trust-env {arguments}" if program.endswith(_PROGRAM) else command


def shown(value: float | None) -> str:
    return "–" if value is None else format_number(value)
