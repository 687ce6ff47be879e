"""How fast it is, as ratios to peers that are timed in the same run.

timings = benchmark()    # about two minutes; benchmark(quick=True): some ten seconds
timings.to_dict()
"""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Sequence
from importlib.metadata import version
from typing import Any

import trust_env
from trust_env.training.console import progress_bar
from trust_env.training.speed import peers, stages, startup, stone_soup, subjects, training_step
from trust_env.training.speed.missing import MissingPeer
from trust_env.training.speed.stopwatch import Run, Spread, measure, ratio
from trust_env.training.speed.timings import FrameLoad, Ratio, Timings
from trust_env.vector import VectorEnv

MPE2, FACE = "mpe2 simple_spread_v3, 3 agents", "case1, PettingZoo face"
BATCH = "trio, 256 worlds, two threads"
CENTRE, NUMPY = "trio's centre, frame by frame", "the same in plain NumPy"
STONESOUP = "Stone Soup GNN, central tracker only"
TRAIN, ZERO_COST = "train on patrol, learners", "the same by SB3 where worlds cost nothing"
CROWDED = ("patrol", "crowd")
WORLDS, THREADS, CROWDED_WORLDS = 256, 2, 32

WANTED: dict[tuple[str, str], tuple[float | None, float | None]] = {
    (FACE, MPE2): (15, 25),
    (BATCH, MPE2): (60, 90),
    (CENTRE, NUMPY): (300, None),
    (CENTRE, STONESOUP): (None, None),
    (TRAIN, ZERO_COST): (0.75, None),
}
"""Ratios, ours to peer: what is wanted at least, and what is aimed at."""


def benchmark(quick: bool = False, progress: bool = True, seconds: float | None = None) -> Timings:
    """Time everything by turns. quick: shorter turns, and no compiling; seconds: length of a turn instead."""
    repetitions, turn = (3, 0.1) if quick else (9, 0.4)
    timed, crowded, skipped = _subjects()
    total = (repetitions + 1) * len(timed) + 3
    with progress_bar("benchmark", total, progress) as (advance, describe):
        describe("benchmark: by turns")
        rates = measure(timed, repetitions, turn if seconds is None else seconds, advance)
        describe("benchmark: stages of a frame")
        stage_times = stages.stage_times(VectorEnv("trio", "trust", WORLDS, threads=1, autoreset=False))
        advance(1)
        describe("benchmark: start-up")
        starting: dict[str, Any] = {"import": startup.import_time(repetitions)}
        advance(1)
        if quick:
            skipped["compiling"] = "left out by `quick`"
        else:
            starting |= startup.first_frame()
        advance(1)
    ratios = [
        Ratio(ours, peer, ratio(rates, ours, peer), *WANTED[ours, peer])
        for ours, peer in WANTED
        if ours in rates and peer in rates
    ]
    loads = [_load(venv, rates[_crowded_name(name)]) for name, venv in crowded.items()]
    spreads = {name: Spread.of(values) for name, values in rates.items()}
    return Timings(quick, _machine(), spreads, ratios, loads, stage_times, starting, skipped)


def _subjects() -> tuple[dict[str, Run], dict[str, VectorEnv], dict[str, str]]:
    """What is timed, peers next to ours; the environments of the crowded scenarios; what is skipped."""
    recorded = subjects.record("trio")
    batch = VectorEnv("trio", "trust", WORLDS, threads=THREADS)
    crowded = {name: VectorEnv(name, "trust", CROWDED_WORLDS, threads=1) for name in CROWDED}
    makers: dict[str, Callable[[], Run]] = {
        MPE2: peers.mpe2_subject,
        FACE: lambda: subjects.parallel_subject("case1"),
        BATCH: lambda: subjects.vector_subject(batch),
        NUMPY: lambda: peers.oracle_subject(recorded),
        CENTRE: lambda: subjects.centre_subject(recorded),
        STONESOUP: lambda: stone_soup.stonesoup_subject(recorded),
        ZERO_COST: training_step.zero_cost_subject,
        TRAIN: training_step.train_subject,
    } | {_crowded_name(name): (lambda venv=venv: subjects.vector_subject(venv)) for name, venv in crowded.items()}
    timed, skipped = {}, {}
    for name, make in makers.items():
        try:
            timed[name] = make()
        except MissingPeer as reason:
            skipped[name] = f"needs {reason}"
    return timed, crowded, skipped


def _crowded_name(scenario: str) -> str:
    return f"{scenario}, {CROWDED_WORLDS} worlds, one thread"


def _load(venv: VectorEnv, rates: Sequence[float]) -> FrameLoad:
    """The load of a frame, counted in the worlds as the timing left them."""
    detections = float(venv.arrays.report_count.sum(axis=1).mean())
    tracks = float((venv.arrays.track_status > 0).sum(axis=1).mean())
    rate = Spread.of(rates).median
    return FrameLoad(venv.scenario.name, detections, tracks, 1e9 / (rate * max(detections * tracks, 1.0)))


def _machine() -> dict[str, Any]:
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    packages = ("numpy", "numba", "pettingzoo")
    return {
        "trust_env": trust_env.__version__,
        "processors": available,
        "platform": platform.platform(),
        "python": platform.python_version(),
        **{name: version(name) for name in packages},
    }
