"""What a report shows of runs that are no evaluations: security curves, training runs, exploitations."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from trust_env.metrics import METRICS
from trust_env.scenario.yaml_lines import read_yaml
from trust_env.training.curves.curve import POINTS
from trust_env.training.evaluation.results import DAMAGE
from trust_env.training.evaluation.run_folder import read_details
from trust_env.training.reports.evaluation import tidied

CURVE, TRAINING, EVALUATIONS, EXPLOITATION = "curve.json", "config.yaml", "evaluations.csv", "exploit.json"
_LEARNED = (DAMAGE, "false_tracks_per_frame", "missing_targets_per_frame")


@contextmanager
def _read_from(file: Path) -> Iterator[None]:
    """ValueError, naming the file, where what is read in the block is not as its command writes it today."""
    try:
        yield
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as fault:
        raise ValueError(f"{file}: not as this version writes it: {type(fault).__name__} {fault}") from None


def curve_section(path: Path) -> dict[str, Any]:
    """A security curve: a line for every attack and defense."""
    with _read_from(path / CURVE):
        return _curve(path, json.loads((path / CURVE).read_text(encoding="utf-8")))


def _curve(path: Path, found: dict[str, Any]) -> dict[str, Any]:
    points, metric = found["points"], found["metric"]
    first = points[0]["results"]
    lines = []
    for number, cell in enumerate(first["cells"]):
        summaries = [point["results"]["cells"][number]["metrics"].get(metric) or {} for point in points]
        bounds = {name: [summary.get(name) for summary in summaries] for name in ("mean", "mean_low", "mean_high")}
        lines.append({"attack": cell["attack"], "defense": cell["defense"], **bounds})
    return {
        "kind": "curve",
        "name": path.name,
        "folder": str(path),
        **{name: first[name] for name in ("scenario", "seed", "episodes", "version")},
        "over": found["over"],
        "meaning": found["meaning"],
        "metric": metric,
        "unit": METRICS[metric].unit,
        "command": next((tidied(read_details(point)[1]) for point in sorted((path / POINTS).glob("*"))), ""),
        "values": [point["value"] for point in points],
        "lines": lines,
    }


def learning_section(paths: Sequence[Path]) -> dict[str, Any]:
    """Training runs: damage in held-out episodes over the steps, a line for each run."""
    return {"kind": "learning", "name": "Learning curves", "runs": [_training(path) for path in paths]}


def _training(path: Path) -> dict[str, Any]:
    config = read_yaml((path / TRAINING).read_text(encoding="utf-8"), str(path / TRAINING))[0]
    with open(path / EVALUATIONS, newline="", encoding="utf-8") as lines, _read_from(path / EVALUATIONS):
        rows = [{name: float(value) for name, value in row.items() if value} for row in csv.DictReader(lines)]
        values = {name: [row[name] for row in rows] for name in ("steps", *_LEARNED)}
        kept = {name: config[name] for name in ("scenario", "defense", "role", "seed")}
    return {"name": path.name, "folder": str(path), **kept, **values}


def exploitation_section(path: Path) -> dict[str, Any]:
    """The attackers of a defense: mean damage in held-out episodes, by how they were found."""
    with _read_from(path / EXPLOITATION):
        found = json.loads((path / EXPLOITATION).read_text(encoding="utf-8"))
        kept = {name: found[name] for name in ("scenario", "defense", "episodes", "seed", "version", "claim", "worst")}
        names = ("kind", "name", "damage", "validation_damage", "margin_over_scripted")
        attackers = [{name: attacker[name] for name in names} for attacker in found["attackers"]]
    return {"kind": "exploitation", "name": path.name, "folder": str(path), **kept, "attackers": attackers}
