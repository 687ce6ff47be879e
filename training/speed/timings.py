"""What a benchmark measured: rates, ratios to peers, loads and start-up times, as values and as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rich.console import Console
from rich.table import Table

from trust_env.training.console import format_number, print_table
from trust_env.training.speed.startup import HEAVY
from trust_env.training.speed.stopwatch import Spread


@dataclass(frozen=True)
class Ratio:
    """How many times as fast ours is as a peer, over the repetitions, beside what is wanted: a busy machine decides."""

    ours: str
    peer: str
    times: Spread
    wanted: float | None
    aim: float | None

    def to_dict(self) -> dict[str, Any]:
        numbers = {"times": self.times.to_dict(), "wanted": self.wanted, "aim": self.aim}
        return {"ours": self.ours, "peer": self.peer} | numbers


@dataclass(frozen=True)
class FrameLoad:
    """How many detections and central tracks a frame holds, and its ns per pair of them on one thread."""

    scenario: str
    detections: float
    tracks: float
    ns_per_pair: float

    @property
    def pairs(self) -> float:
        return self.detections * self.tracks

    def to_dict(self) -> dict[str, Any]:
        return asdict(self) | {"pairs": self.pairs}


@dataclass(frozen=True)
class Timings:
    """Everything that a benchmark measured; `skipped`: by name, why something could not be timed."""

    quick: bool
    machine: dict[str, Any]
    rates: dict[str, Spread]  # frames per second
    ratios: list[Ratio]
    loads: list[FrameLoad]
    stages: dict[str, float]  # s that a world of trio takes, on one thread, by the stage of a frame
    startup: dict[str, Any]
    skipped: dict[str, str]

    def to_dict(self) -> dict[str, Any]:
        """Plain values only, ready for JSON."""
        return {
            "quick": self.quick,
            "machine": self.machine,
            "frames_per_second": {name: rate.to_dict() for name, rate in self.rates.items()},
            "ratios": [each.to_dict() for each in self.ratios],
            "loads": [load.to_dict() for load in self.loads],
            "stages": self.stages,
            "startup": self.startup,
            "skipped": self.skipped,
        }

    def print(self, console: Console) -> None:
        """Print every table, the start-up times, and what was skipped."""
        for table in (_rate_table(self), _ratio_table(self.ratios), _load_table(self.loads), _stage_table(self.stages)):
            print_table(console, table)
        seconds, brought = self.startup["import"]["seconds"]["median"], self.startup["import"]["brings_in"]
        light = f"brings in {', '.join(brought)}" if brought else f"none of {', '.join(HEAVY)}"
        console.print(f"import trust_env: {seconds:.2f} s, {light}", markup=False)
        if "compiling_seconds" in self.startup:
            compiled, cached = self.startup["compiling_seconds"], self.startup["from_cache_seconds"]
            console.print(f"first frame: {compiled:.1f} s compiling, {cached:.1f} s from the cache", markup=False)
        for name, reason in self.skipped.items():
            console.print(f"skipped: {name}: {reason}", markup=False)


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
        wanted, aim = ("–" if value is None else f"{value:g}" for value in (each.wanted, each.aim))
        spread = f"{format_number(each.times.low)} to {format_number(each.times.high)}"
        table.add_row(each.ours, each.peer, format_number(each.times.median), spread, wanted, aim)
    return table


def _load_table(loads: Sequence[FrameLoad]) -> Table:
    table = Table("scenario", title="What a frame holds, and what it costs on one thread")
    for name in ("detections", "central tracks", "pairs", "ns per pair"):
        table.add_column(name, justify="right")
    for load in loads:
        values = (load.detections, load.tracks, load.pairs, load.ns_per_pair)
        table.add_row(load.scenario, *(format_number(value) for value in values))
    return table


def _stage_table(stages: Mapping[str, float]) -> Table:
    table, whole = Table("stage", title="Where a frame of trio goes, on one thread"), sum(stages.values())
    for name in ("us", "share"):
        table.add_column(name, justify="right")
    for name, seconds in sorted(stages.items(), key=lambda each: -each[1]):
        table.add_row(name, format_number(1e6 * seconds), f"{100.0 * seconds / whole:.0f} %")
    return table
