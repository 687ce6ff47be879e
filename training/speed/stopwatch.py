"""Rates of several subjects, measured by turns, so that other work on the machine slows all alike."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

Run = Callable[[int], int | None]
"""Runs a number of frames; where it runs more, it returns how many."""


@dataclass(frozen=True)
class Spread:
    """Median, least and greatest over the repetitions."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        return cls(statistics.median(values), min(values), max(values))

    def to_dict(self) -> dict[str, float]:
        return asdict(self)


def measure(
    subjects: Mapping[str, Run],
    repetitions: int,
    seconds: float,
    advance: Callable[[int], Any] = lambda _: None,
) -> dict[str, list[float]]:
    """Frames per second of every subject in every repetition: A B C A B C ..., each about `seconds` long.

    `advance(1)` is called after every turn; in one more turn than there are repetitions they warm up.
    """
    frames = {}
    for name, run in subjects.items():
        frames[name] = _frames_in(run, seconds)
        advance(1)
    rates: dict[str, list[float]] = {name: [] for name in subjects}
    for _ in range(repetitions):
        for name, run in subjects.items():
            done, taken = _time_run(run, frames[name])
            rates[name].append(done / taken)
            advance(1)
    return rates


def ratio(rates: Mapping[str, Sequence[float]], ours: str, peer: str) -> Spread:
    """How many times as fast ours is as the peer, over the repetitions."""
    return Spread.of([a / b for a, b in zip(rates[ours], rates[peer], strict=True)])


def _frames_in(run: Run, seconds: float) -> int:
    """How many frames fit into so many seconds, at least one; everything is warm after that."""
    run(1)
    done, taken = _time_run(run, 1)
    while taken < seconds / 4:
        done, taken = _time_run(run, 2 * done)
    return max(1, round(done * seconds / taken))


def _time_run(run: Run, frames: int) -> tuple[int, float]:
    """The number of frames that were run, and the seconds that they took."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        start = time.perf_counter()
        done = run(frames)
        return done or frames, time.perf_counter() - start
    finally:
        if collecting:
            gc.enable()
