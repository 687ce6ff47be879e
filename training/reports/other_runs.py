"""What a report shows of runs that are no evaluations: security curves, training runs, exploitations."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from trust_env.metrics import METRICS
from trust_env.scenario.yaml_lines import read_yaml
from trust_env.training.evaluation.results import DAMAGE

CURVE, TRAINING, EVALUATIONS, EXPLOITATION = "curve.json", "config.yaml", "evaluations.csv", "exploit.json"
_LEARNED = (DAMAGE, "false_tracks_per_frame", "missing_targets_per_frame")


def curve_section(path: Path) -> dict[str, Any]:
    """A security curve: a line for every attack and defense."""
    found = json.loads((path / CURVE).read_text(encoding="utf-8"))
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
        "values": [point["value"] for point in points],
        "lines": lines,
    }


def learning_section(paths: Sequence[Path]) -> dict[str, Any]:
    """Training runs: damage in held-out episodes over the steps, a line for each run."""
    runs = []
    for path in paths:
        config = read_yaml((path / TRAINING).read_text(encoding="utf-8"), str(path / TRAINING))[0]
        with open(path / EVALUATIONS, newline="", encoding="utf-8") as lines:
            rows = [{name: float(value) for name, value in row.items() if value} for row in csv.DictReader(lines)]
        values = {name: [row.get(name) for row in rows] for name in _LEARNED}
        kept = {name: config[name] for name in ("scenario", "defense", "role", "seed")}
        runs.append({"name": path.name, "folder": str(path), **kept, "steps": [row["steps"] for row in rows], **values})
    return {"kind": "learning", "name": "Learning curves", "runs": runs}


def exploitation_section(path: Path) -> dict[str, Any]:
    """The attackers of a defense: mean damage in held-out episodes, by how they were found."""
    found = json.loads((path / EXPLOITATION).read_text(encoding="utf-8"))
    kept = {name: found[name] for name in ("scenario", "defense", "episodes", "seed", "version", "claim", "worst")}
    return {"kind": "exploitation", "name": path.name, "folder": str(path), **kept, "attackers": found["attackers"]}
