"""Runs that are killed, or find the disk full, at random: nothing that was finished is lost, and the end is the same.

The end is compared, bit for bit, with that of a run left in peace.
"""

from __future__ import annotations

import random
import tempfile
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from folder_runs import (
    EVALUATE,
    EXPLOIT,
    RANK_FULL,
    RANK_QUICK,
    RANK_SEARCH,
    TRAIN,
    FolderRun,
    kill,
    out_of_space,
    played_in_peace,
)

from soak.tally import Tally

Trial = Callable[[FolderRun, Path, float, random.Random], Counter[int]]


def killed(run: FolderRun, folder: Path, seconds: float, rng: random.Random) -> Counter[int]:
    """How many parts were finished when a run was killed, twice, before it could end."""
    return Counter(kill(run, folder, 0, rng.uniform(0.0, 0.8 * seconds)) for _ in range(2))


def out_of_disk(run: FolderRun, folder: Path, seconds: float, rng: random.Random) -> Counter[int]:
    """How many parts were finished when files reached a size of 0.1 to 20 kB."""
    told = out_of_space(run, folder, round(100 * 200 ** rng.random()))
    assert f"error: {folder}/" in told and "File too large" in told, told
    return Counter([len(run.finished(folder))])


def soak(run: FolderRun, trial: Trial, trials: int, amount: float) -> Tally:
    """Trials of a run, each in a folder of its own and then played to the end."""
    survived, failures, rng = Counter[int](), list[str](), random.Random()
    with tempfile.TemporaryDirectory() as place:
        whole, seconds = played_in_peace(run, Path(place) / "whole")
        for i in range(max(1, round(trials * amount))):
            folder = Path(place) / f"trial_{i}"
            try:
                survived += trial(run, folder, seconds, rng)
                _assert_same(played_in_peace(run, folder)[0], whole)
            except Exception as fault:
                failures.append(f"{run.name}: {type(fault).__name__}: {fault}".replace("\n", " "))
    counts = ", ".join(f"{count} with {parts}" for parts, count in sorted(survived.items()))
    print(f"    {run.name}, stopped with so many parts finished: {counts}")
    return Tally("stops", survived.total() + len(failures), failures)


def _assert_same(found: dict[str, Any], whole: dict[str, Any]) -> None:
    differing = [name for name in whole | found if found.get(name) != whole.get(name)]
    assert not differing, f"differs from the run left in peace in {', '.join(differing)}"


SOAKS = {
    "kill-evaluate": partial(soak, EVALUATE, killed, 20),
    "kill-exploit": partial(soak, EXPLOIT, killed, 20),
    "kill-train": partial(soak, TRAIN, killed, 10),
    "kill-quick": partial(soak, RANK_QUICK, killed, 10),
    "kill-full": partial(soak, RANK_FULL, killed, 10),
    "kill-search": partial(soak, RANK_SEARCH, killed, 10),
    "disk-evaluate": partial(soak, EVALUATE, out_of_disk, 10),
    "disk-exploit": partial(soak, EXPLOIT, out_of_disk, 10),
    "disk-train": partial(soak, TRAIN, out_of_disk, 10),
}
