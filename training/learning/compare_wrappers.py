"""Which action wrapper learns fastest: the same training with every wrapper against every defense.

    python -m trust_env.training.learning.compare_wrappers --out results/wrappers

Writes wrappers.csv, like `compare_wrappers.csv` beside this file, and prints the table. All runs have the
network and the algorithm of `defaults.yaml`; damage is measured in held-out episodes by the environment's own
metrics.
"""

from __future__ import annotations

import csv
import io
import itertools
import time
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from trust_env.files import write_atomically

COLUMNS = ("wrapper", "defense", "seed", "steps", "seconds", "damage", "false_tracks", "missing_targets")


def compare(
    out: Annotated[Path, tyro.conf.arg(help="folder for wrappers.csv and the runs; what is there is kept")],
    wrappers: tuple[str, ...] = ("raw", "phantoms", "grid", "by_need"),
    defenses: tuple[str, ...] = ("score", "trust"),
    seeds: Annotated[int, tyro.conf.arg(help="training seeds, from 0")] = 2,
    steps: int = 500_000,
    scenario: str = "patrol",
    episodes: Annotated[int, tyro.conf.arg(help="held-out episodes per run")] = 100,
) -> None:
    """Train every wrapper against every defense, play what has been learned, and tabulate the damage."""
    file = out / "wrappers.csv"
    rows = _read(file)
    for wrapper, defense, seed in itertools.product(wrappers, defenses, range(seeds)):
        if not any((wrapper, defense, seed, steps) == row[:4] for row in rows):
            rows.append(_row(out, wrapper, defense, seed, steps, scenario, episodes))
            _write(file, rows)
    print(_table(rows))


def _row(out: Path, wrapper: str, defense: str, seed: int, steps: int, scenario: str, episodes: int) -> tuple:
    from trust_env.training.evaluation.evaluate import evaluate
    from trust_env.training.learning.train import train

    folder, start = out / f"{wrapper}-{defense}-{seed}-{steps}", time.perf_counter()
    run = train(scenario, defense, steps, seed, folder, wrapper=wrapper, overrides={"evaluation.every": steps})
    seconds = time.perf_counter() - start
    metrics = evaluate(scenario, [str(run.folder)], defense, episodes).cells[0].metrics
    names = ("damage_per_frame", "false_tracks_per_frame", "missing_targets_per_frame")
    return wrapper, defense, seed, steps, round(seconds), *(round(float(metrics[n].mean()), 3) for n in names)


def _read(file: Path) -> list[tuple]:
    if not file.exists():
        return []
    with file.open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    return [(r["wrapper"], r["defense"], *map(int, (r["seed"], r["steps"], r["seconds"])),
             *(float(r[name]) for name in COLUMNS[5:])) for r in rows]  # fmt: skip


def _write(file: Path, rows: list[tuple]) -> None:
    text = io.StringIO(newline="")
    csv.writer(text).writerows([COLUMNS, *rows])
    write_atomically(file, lambda path: path.write_bytes(text.getvalue().encode()))


def _table(rows: list[tuple]) -> str:
    """Damage per frame by wrapper and defense: the mean of the seeds, and each."""
    defenses = list(dict.fromkeys(row[1] for row in rows))
    lines = ["| wrapper | steps | " + " | ".join(defenses) + " |", "| --- |" + " --- |" * (1 + len(defenses))]
    for wrapper, steps in dict.fromkeys((row[0], row[3]) for row in rows):
        found = [[r[5] for r in rows if (r[0], r[3], r[1]) == (wrapper, steps, d)] for d in defenses]
        cells = [f"{np.mean(f):.2f} ({', '.join(f'{x:.2f}' for x in f)})" if f else "" for f in found]
        lines.append(f"| `{wrapper}` | {steps:,} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    tyro.cli(compare)
