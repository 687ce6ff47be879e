"""kill -9 at random moments: nothing that was finished is lost, and the end is that of a run left in peace."""

from __future__ import annotations

import random
import tempfile
from collections import Counter
from pathlib import Path

from folder_runs import EVALUATE, EXPLOIT, FolderRun, killed_at_random


def kills_of_evaluate(kills: int = 20, seed: int | None = None) -> tuple[int, int]:
    """Kills of `evaluate`, and those that were survived, or an AssertionError."""
    return _kills(EVALUATE, kills, seed)


def kills_of_exploit(kills: int = 20, seed: int | None = None) -> tuple[int, int]:
    """Kills of `exploit`, in searches, training runs and the evaluation, and those that were survived."""
    return _kills(EXPLOIT, kills, seed)


def _kills(run: FolderRun, kills: int, seed: int | None) -> tuple[int, int]:
    with tempfile.TemporaryDirectory() as folder:
        survived = list(killed_at_random(run, Path(folder), kills, random.Random(seed)))
    counts = sorted(Counter(survived).items())
    print(f"{run.arguments[0]}: kills after so many finished parts: " + ", ".join(f"{n}: {k}" for n, k in counts))
    return kills, len(survived)
