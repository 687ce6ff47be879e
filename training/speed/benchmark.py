"""How fast it is, as ratios to peers that are timed in the same run.

timings = benchmark()    # about two minutes; benchmark(quick=True): some ten seconds
timings.to_dict()
"""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

import trust_env
from trust_env.training.console import format_number, progress_bar
from trust_env.training.speed import learning, peers, startup, subjects
from trust_env.training.speed.stopwatch import Run, Spread, measure, ratio
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


@dataclass(frozen=True)
class Ratio:
    """How many times as fast ours is as a peer, over the repetitions."""

    ours: str
    peer: str
    times: Spread
    wanted: float | None
    aim: float | None

    @property
    def met(self) -> bool | None:
        """None where nothing is wanted."""
        return None if self.wanted is None else self.times.median >= self.wanted

    def to_dict(self) -> dict[str, Any]:
        numbers = {"times": self.times.to_dict(), "wanted": self.wanted, "aim": self.aim, "met": self.met}
        return {"ours": self.ours, "peer": self.peer} | numbers


@dataclass(frozen=True)
class Load:
    """What a frame holds: detections of all agents, central tracks; and ns per pair of them on one thread."""

    scenario: str
    detections: float
    tracks: float
    ns_per_pair: float

    def to_dict(self) -> dict[str, Any]:
        return {**self.__dict__, "pairs": self.detections * self.tracks}


@dataclass(frozen=True)
class Timings:
    """rates: frames per second of everything timed; skipped: by name, what could not be timed and why."""

    quick: bool
    machine: dict[str, Any]
    rates: dict[str, Spread]
    ratios: list[Ratio]
    loads: list[Load]
    startup: dict[str, Any]
    skipped: dict[str, str]

    @property
    def ok(self) -> bool:
        """Every measured ratio is at least what is wanted, and `import trust_env` stays light."""
        return all(r.met is not False for r in self.ratios) and not self.startup["import"]["brings_in"]

    def to_dict(self) -> dict[str, Any]:
        """Plain values only, ready for JSON."""
        return {
            "ok": self.ok,
            "quick": self.quick,
            "machine": self.machine,
            "frames_per_second": {name: rate.to_dict() for name, rate in self.rates.items()},
            "ratios": [each.to_dict() for each in self.ratios],
            "loads": [load.to_dict() for load in self.loads],
            "startup": self.startup,
            "skipped": self.skipped,
        }

    def print(self, console: Console) -> None:
        console.print(_rate_table(self))
        console.print(_ratio_table(self.ratios))
        console.print(_load_table(self.loads))
        seconds, brought = self.startup["import"]["seconds"]["median"], self.startup["import"]["brings_in"]
        light = f"brings in {', '.join(brought)}" if brought else f"none of {', '.join(startup.HEAVY)}"
        console.print(f"import trust_env: {seconds:.2f} s, {light}", markup=False)
        if "compiling_seconds" in self.startup:
            compiled, cached = self.startup["compiling_seconds"], self.startup["from_cache_seconds"]
            console.print(
                f"first frame: {compiled:.1f} s compiling, {cached:.1f} s from the cache", markup=False
            )
        for name, reason in self.skipped.items():
            console.print(f"skipped: {name}: {reason}", markup=False)


def benchmark(quick: bool = False, progress: bool = True, seconds: float | None = None) -> Timings:
    """Time everything by turns. quick: shorter turns, and no compiling; seconds: length of a turn instead."""
    repetitions, turn = (3, 0.1) if quick else (9, 0.4)
    timed, crowded, skipped = _subjects()
    total = (repetitions + 1) * len(timed) + 2
    with progress_bar("benchmark", total, progress) as (advance, tell):
        tell("benchmark: by turns")
        rates = measure(timed, repetitions, turn if seconds is None else seconds, advance)
        tell("benchmark: start-up")
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
    return Timings(quick, _machine(), spreads, ratios, loads, starting, skipped)


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
        STONESOUP: lambda: peers.stonesoup_subject(recorded),
        ZERO_COST: learning.zero_cost_subject,
        TRAIN: learning.train_subject,
    } | {
        _crowded_name(name): (lambda venv=venv: subjects.vector_subject(venv))
        for name, venv in crowded.items()
    }
    timed, skipped = {}, {}
    for name, make in makers.items():
        try:
            timed[name] = make()
        except peers.Missing as reason:
            skipped[name] = f"needs {reason}"
    return timed, crowded, skipped


def _crowded_name(scenario: str) -> str:
    return f"{scenario}, {CROWDED_WORLDS} worlds, one thread"


def _load(venv: VectorEnv, rates: Sequence[float]) -> Load:
    """Counted in the worlds as the timing left them."""
    detections = float(venv.arrays.report_count.sum(axis=1).mean())
    tracks = float((venv.arrays.track_status > 0).sum(axis=1).mean())
    rate = Spread.of(rates).median
    return Load(venv.scenario.name, detections, tracks, 1e9 / (rate * max(detections * tracks, 1.0)))


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


# --- on the screen -------------------------------------------------------------------------------------


def _rate_table(timings: Timings) -> Table:
    table = Table("timed by turns", title=f"Frames per second, {timings.machine['processors']} processors")
    for name in ("median", "least", "greatest"):
        table.add_column(name, justify="right")
    for name, rate in timings.rates.items():
        table.add_row(name, *(f"{value:,.0f}" for value in (rate.median, rate.low, rate.high)))
    return table


def _ratio_table(ratios: Sequence[Ratio]) -> Table:
    table = Table("ours", "peer", title="How many times as fast, in the same run")
    for name in ("median", "least to greatest", "wanted", "aim"):
        table.add_column(name, justify="right")
    for each in ratios:
        style = {True: "green", False: "bold red", None: ""}[each.met]
        wanted, aim = ("–" if value is None else f"{value:g}" for value in (each.wanted, each.aim))
        spread = f"{format_number(each.times.low)} to {format_number(each.times.high)}"
        median = Text(format_number(each.times.median), style=style)
        table.add_row(each.ours, each.peer, median, spread, wanted, aim)
    return table


def _load_table(loads: Sequence[Load]) -> Table:
    table = Table("scenario", title="What a frame holds, and what it costs on one thread")
    for name in ("detections", "central tracks", "pairs", "ns per pair"):
        table.add_column(name, justify="right")
    for load in loads:
        pairs = load.detections * load.tracks
        values = (load.detections, load.tracks, pairs, load.ns_per_pair)
        table.add_row(load.scenario, *(format_number(value) for value in values))
    return table
