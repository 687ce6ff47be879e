"""How much `joint_posterior` depends on each of its parameters, and what each of its terms is for.

    python -m trust_env.training.research.joint_posterior --out results/joint_posterior

Writes sensitivity.csv, like `joint_posterior.csv` beside this file, and prints the table: mean damage per frame by
attack with one parameter changed at a time, and the share of benign agents that are accused. Its seed is none that
a published table is made with.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from trust_env.files import write_atomically
from trust_env.spec import Spec
from trust_env.training.evaluation.evaluate import evaluate

ATTACKS = (
    "honest",
    "false_positive",
    "fov_aware",
    "fov_aware(noise=0.0)",
    "exclusive",
    "outward",
    "stealth",
    "suppress",
)
CHANGES: tuple[dict[str, object], ...] = (
    {},
    {"pi": 0.15},
    {"pi": 0.4},
    {"kappa": 0.002},
    {"kappa": 0.02},
    {"eps": 0.01},
    {"eps": 0.04},
    {"r": 0.6},
    {"r": 0.9},
    {"kinematics": False},
    {"exactness": False},
    {"counts": False},
    {"departures": False},
    {"edges": False},
    {"memory": 0.0},
    {"cap_track": 60.0},
)
COLUMNS = ("scenario", "changed", "attack", "damage", "accused")
Row = tuple[str, str, str, float, float]


def study(
    out: Annotated[Path, tyro.conf.arg(help="folder for sensitivity.csv")],
    scenarios: tuple[str, ...] = ("patrol", "trio"),
    episodes: int = 50,
    seed: int = 1000,
) -> None:
    """Play every attack against `joint_posterior` with one parameter changed at a time, and tabulate."""
    rows: list[Row] = []
    for scenario in scenarios:
        defenses = [str(Spec("joint_posterior", change)) for change in CHANGES]
        found = evaluate(scenario, list(ATTACKS), defenses, episodes, seed)
        for change, defense in zip(CHANGES, defenses, strict=True):
            name = ", ".join(f"{key} = {value}" for key, value in change.items()) or "none"
            rows += [(scenario, name, attack, *_measured(found[attack, defense].metrics)) for attack in ATTACKS]
    _write(out / "sensitivity.csv", rows)
    print(_table(rows))


def _measured(metrics: dict[str, np.ndarray]) -> tuple[float, float]:
    """Mean damage per frame, and the share of benign agents accused."""
    damage, accused = (float(np.nanmean(metrics[name])) for name in ("damage_per_frame", "false_accusation_rate"))
    return round(damage, 3), round(accused, 4)


def _write(file: Path, rows: list[Row]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    text = io.StringIO(newline="")
    csv.writer(text).writerows([COLUMNS, *rows])
    write_atomically(file, lambda path: path.write_bytes(text.getvalue().encode()))


def _table(rows: list[Row]) -> str:
    """Damage by change and attack, a table for each scenario; last, the share of benign agents accused."""
    lines: list[str] = []
    for scenario in dict.fromkeys(row[0] for row in rows):
        lines += [f"| {scenario}: changed | " + " | ".join(f"`{a}`" for a in ATTACKS) + " | accused |"]
        lines += ["| --- |" + " --- |" * (len(ATTACKS) + 1)]
        for change in dict.fromkeys(row[1] for row in rows):
            of_change = [row for row in rows if row[:2] == (scenario, change)]
            cells = [f"{row[3]:.2f}" for row in of_change] + [f"{np.mean([row[4] for row in of_change]):.1%}"]
            lines.append(f"| {change} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    tyro.cli(study)
