"""Damage, or another metric, over a condition of the scenario: the same attacks and defenses at every value.

found = curve("adversaries", scenario="patrol", attacks="false_positive", defenses="score,trust", out="RUN")
found.summary("false_positive", "trust", 2).mean     # at two adversaries
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from trust_env.errors import unknown_name
from trust_env.files import expanded, locked, require_empty, write_atomically
from trust_env.metrics import METRICS
from trust_env.scenario import load_scenario
from trust_env.training.curves.axes import axis_of
from trust_env.training.curves.figure import curve_figure, has_matplotlib
from trust_env.training.curves.points import Curve
from trust_env.training.evaluation.evaluate import evaluate
from trust_env.training.evaluation.results import DAMAGE
from trust_env.training.evaluation.run_folder import ROWS

REPORT, TABLE, FIGURE, POINTS = "curve.json", "curve.parquet", "curve.png", "points"


def curve(
    over: str = "adversaries",
    values: Sequence[Any] | None = None,
    scenario: Any = "patrol",
    attacks: str | Iterable[Any] = "false_positive",
    defenses: str | Iterable[Any] = "score,trust",
    episodes: int = 50,
    seed: int = 0,
    out: str | Path | None = None,
    resume: bool = False,
    metric: str = DAMAGE,
    knowledge: str | None = None,
    data: str | Path | None = None,
    overrides: Mapping[str, Any] | None = None,
    progress: bool = True,
) -> Curve:
    """Play attacks against defenses at every value of a condition, on the same episodes.

    over: `adversaries`, `p_detect`, `clutter`, `spread`, `slots`, or a field of the scenario by its dotted path, as
    `actuation` or `tracker.fusion`; values: those it takes (default: the condition's own). The rest as `evaluate`
    takes it. out: a new or empty folder for curve.json, curve.parquet, curve.png (where matplotlib is installed)
    and a run of `evaluate` for every value in `points`; with `resume` what is finished there is kept, and more
    values may be given than before.

    Raises ValueError for what cannot be played, before anything is, OSError for a folder that cannot be written.
    """
    if metric not in METRICS:
        raise unknown_name("metric", metric, METRICS)
    axis, fields = axis_of(over), {**(overrides or {}), **({} if data is None else {"targets.data": data})}
    world = load_scenario(scenario, **fields)
    chosen = list(axis.values(world) if values is None else values)
    names = [f"{over}={value}" for value in chosen]
    if not chosen or len(set(names)) < len(names):
        raise ValueError(f"values: expected at least one, each once; got {chosen}")
    settings = [{**fields, **axis.fields(world, value)} for value in chosen]
    for changed in settings:
        load_scenario(scenario, **changed)
    folder = None if out is None else expanded(out)

    def play_all() -> Curve:
        found = []
        for value, name, changed in zip(chosen, names, settings, strict=True):
            at = None if folder is None else folder / POINTS / name.replace("/", "_")
            begun = at is not None and (at / ROWS).is_file()
            options = {"knowledge": knowledge, "overrides": changed, "progress": progress}
            found.append((value, evaluate(scenario, attacks, defenses, episodes, seed, at, begun, **options)))
        return Curve(over, axis.meaning, metric, tuple(found))

    if folder is None:
        return play_all()
    with locked(folder):
        if not resume:
            require_empty(folder, "--resume to continue the curve in it")
        found = play_all()
        _save(found, folder)
        return found


def _save(found: Curve, folder: Path) -> None:
    import pyarrow.parquet as pq

    text = json.dumps(found.to_dict(), indent=2, allow_nan=False) + "\n"
    write_atomically(folder / REPORT, lambda file: file.write_text(text, encoding="utf-8"))
    table = found.to_arrow()
    write_atomically(folder / TABLE, lambda file: pq.write_table(table, file))
    if has_matplotlib():
        figure = curve_figure(found)
        write_atomically(folder / FIGURE, lambda file: figure.savefig(file, dpi=150))
