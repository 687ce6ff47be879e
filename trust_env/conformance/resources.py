"""Resources: closing twice, and memory that does not grow."""

from __future__ import annotations

import contextlib
import gc
import os
import tracemalloc
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

from trust_env.conformance.report import Failed
from trust_env.conformance.rollout import Env, advance, begin, play, replay
from trust_env.conformance.subject import Check, Subject

WARM_LAPS, LAPS = 2, 4
MIN_LAP_STEPS, MAX_LAP_STEPS = 60, 300
# Less growth than this is noise: caches that fill, fragmentation.
MIN_TRACED_BYTES, MIN_RESIDENT_BYTES = 16 * 2**10, 32 * 2**20


def close_twice(subject: Subject) -> None:
    """`close` works before the first reset, after a step, and a second time."""
    for used in (False, True):
        env = subject.env()
        if used:
            play(env, replay(subject.reference[1:]), min(1, len(subject.reference) - 1), subject.seed)
        env.close()
        env.close()


def memory(subject: Subject) -> str:
    """Memory stops growing after the first episodes: Python's, and the process's where that can be read."""
    env, steps = subject.env(), _lap_steps(subject)  # measured before tracing slows everything down
    with _tracing():
        samples = [_sample(subject, env, steps) for _ in range(WARM_LAPS + LAPS)][WARM_LAPS - 1 :]
    traced, resident = zip(*samples)
    _require_no_growth("Python", traced, MIN_TRACED_BYTES, steps)
    _require_no_growth("process", resident, MIN_RESIDENT_BYTES, steps)
    return f"{LAPS} laps of {steps} steps"


def _require_no_growth(whose: str, sizes: Sequence[int], noise: int, steps: int) -> None:
    """Raise Failed where the bytes after each lap grow in every lap, and in all by more than the noise."""
    growth = [after - before for before, after in pairwise(sizes)]
    if sizes[-1] - sizes[0] > noise and all(bytes_ > 0 for bytes_ in growth):
        laps = ", ".join(f"{bytes_ / 1024:.1f}" for bytes_ in growth)
        raise Failed(f"{whose} memory grows in each of {LAPS} laps of {steps} steps: {laps} KiB")


def _sample(subject: Subject, env: Env, steps: int) -> tuple[int, int]:
    """Bytes in use after another lap: Python's, and the process's (0 where it cannot be read)."""
    _play_lap(subject, env, steps)
    gc.collect()
    statm = Path("/proc/self/statm")
    resident = int(statm.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") if statm.exists() else 0
    return tracemalloc.get_traced_memory()[0], resident


def _play_lap(subject: Subject, env: Env, left: int) -> None:
    """Play episodes until no steps are left."""
    while left > 0:
        frame, policy = begin(env, subject.seed), subject.make_policy(env, subject.seed)
        left -= 1  # a reset counts as well: episodes without any step would never end the lap
        for _ in advance(env, frame, policy, left, keep=lambda frame: frame):
            left -= 1


def _lap_steps(subject: Subject) -> int:
    """Steps in a lap: an episode if it is not too long, several short ones, or as many as time allows."""
    wanted = min(MAX_LAP_STEPS, max(MIN_LAP_STEPS, len(subject.reference)))
    affordable = subject.max_seconds / (4 * (WARM_LAPS + LAPS) * max(subject.seconds_per_step, 1e-9))
    return max(5, min(wanted, int(affordable)))


@contextlib.contextmanager
def _tracing() -> Iterator[None]:
    """Trace allocations; where they are traced already, leave that as it is."""
    if tracemalloc.is_tracing():
        yield
        return
    tracemalloc.start()
    try:
        yield
    finally:
        tracemalloc.stop()


CHECKS: dict[str, Check] = {"close_twice": close_twice, "memory": memory}
