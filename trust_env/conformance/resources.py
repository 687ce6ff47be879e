"""What an environment holds on to."""

from __future__ import annotations

import contextlib
import gc
import os
import tracemalloc
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

from trust_env.conformance.report import Check, Failed
from trust_env.conformance.rollout import Env, advance, begin, play, replay
from trust_env.conformance.subject import Subject

WARM_LAPS, LAPS = 2, 4
MIN_LAP_STEPS, MAX_LAP_STEPS = 60, 300
# Below these, growth is noise: caches that fill, fragmentation.
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
    """Memory stops growing after the first episodes: Python's, and the process's where that is readable."""
    env, steps = subject.env(), _lap_steps(subject)  # timed before the tracing slows everything down
    with _tracing():
        samples = [_sample(subject, env, steps) for _ in range(WARM_LAPS + LAPS)][WARM_LAPS - 1 :]
    for index, (what, least) in enumerate((("Python", MIN_TRACED_BYTES), ("process", MIN_RESIDENT_BYTES))):
        sizes = [sample[index] for sample in samples]
        if sizes[-1] - sizes[0] > least and all(b > a for a, b in pairwise(sizes)):
            growth = ", ".join(f"{(b - a) / 1024:.1f}" for a, b in pairwise(sizes))
            raise Failed(f"{what} memory grows in each of {LAPS} laps of {steps} steps: {growth} KiB")
    return f"{LAPS} laps of {steps} steps"


def _sample(subject: Subject, env: Env, steps: int) -> tuple[int, int]:
    """Bytes in use after another lap: Python's, and the process's (0 where the system does not tell)."""
    _play_a_lap(subject, env, steps)
    gc.collect()
    statm = Path("/proc/self/statm")
    resident = int(statm.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") if statm.exists() else 0
    return tracemalloc.get_traced_memory()[0], resident


def _play_a_lap(subject: Subject, env: Env, left: int) -> None:
    """Whole episodes, one after the other, until the steps are spent."""
    while left > 0:
        frame, policy = begin(env, subject.seed), subject.make_policy(env, subject.seed)
        left -= 1  # an episode without any step must not go on for ever
        for _ in advance(env, frame, policy, left, keep=lambda frame: frame):
            left -= 1


def _lap_steps(subject: Subject) -> int:
    """A whole episode if it is not too long, some short ones, or what time allows: tracing is slow."""
    wanted = min(MAX_LAP_STEPS, max(MIN_LAP_STEPS, len(subject.reference)))
    affordable = subject.max_seconds / (4 * (WARM_LAPS + LAPS) * max(subject.seconds_per_step, 1e-9))
    return max(5, min(wanted, int(affordable)))


@contextlib.contextmanager
def _tracing() -> Iterator[None]:
    """Trace allocations, unless somebody already does."""
    if tracemalloc.is_tracing():
        yield
        return
    tracemalloc.start()
    try:
        yield
    finally:
        tracemalloc.stop()


CHECKS: dict[str, Check] = {"close_twice": close_twice, "memory": memory}
