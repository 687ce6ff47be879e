"""Code for another processor: counts are the same, distances but for rounding."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from trust_env.compiled.mode import INTERPRETED

PLAY = """
import sys
import numpy as np
import trust_env

env = trust_env.vector_env("patrol", "trust", num_worlds=64, autoreset=False)
env.reset(seed=0)
rng, counts, distances = np.random.default_rng(0), [], []
for frame in range(199):
    if frame % 9 == 0:
        actions = rng.uniform(-1.0, 1.0, env.arrays.action.shape)
    info = env.step(actions)[-1]
    counts.append([info[name] for name in ("false_tracks", "missing_targets", "published_tracks")])
    distances.append(info["gospa"])
np.savez(sys.argv[1], counts=counts, distances=distances)
"""


def play(file: Path, **environment: str) -> dict[str, np.ndarray]:
    subprocess.run([sys.executable, "-c", PLAY, str(file)], env=os.environ | environment, check=True)
    return dict(np.load(file))


@pytest.mark.slow
@pytest.mark.skipif(INTERPRETED, reason="needs the compiler")
def test_a_generic_processor_counts_the_same(tmp_path):
    here, generic = play(tmp_path / "here.npz"), play(tmp_path / "generic.npz", NUMBA_CPU_NAME="generic")
    assert here["counts"].sum() > 1000 and np.array_equal(here["counts"], generic["counts"])
    assert np.abs(here["distances"] - generic["distances"]).max() < 1e-11
