"""Random frames over random scenarios, attacks and defenses, with every index checked."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
from extreme_scenarios import draw_scenario
from extreme_worlds import DEFENSES
from invariants import check

import trust_env
from soak.tally import Tally
from trust_env.agents import Player

ATTACKS = ("honest", "random", "false_positive", "false_positive(n=3, speed=5)", "suppress", "fov_aware(n=4)")
ATTACKS += ("optimal_false_positive", "sleeper(start=5, inner=false_positive)", "on_off(inner=suppress)")
WORLDS, FRAMES = 32, 60


def run(amount: float) -> Tally:
    """A million frames, or that part of them, in a process whose kernels are compiled with checks of indices."""
    command = [sys.executable, "-m", "soak.frames", str(round(1e6 * amount))]
    environment = os.environ | {"NUMBA_BOUNDSCHECK": "1"}
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=False)
    lines = done.stdout.splitlines()
    tally = Tally("frames", int(lines[0]) if lines else 1, lines[1:])
    if done.returncode:
        tally.failures.append(f"ended with {done.returncode}")
    return tally


def _play(seed: int) -> int:
    """Frames played in one scenario; raises where something does not hold."""
    rng = np.random.default_rng(seed)
    scenario = draw_scenario(rng, most_bytes=5e5, most_pairs=2e5)
    env = trust_env.vector_env(scenario, str(rng.choice(DEFENSES)), num_worlds=WORLDS, threads=1)
    observations, _ = env.reset(seed=int(rng.integers(2**63)))
    try:
        player = Player(env, {"adversary": str(rng.choice(ATTACKS))})
        player.actions(observations)
    except ValueError:  # the attack wants to observe more, or more slots, than this scenario has
        player = Player(env, {"adversary": "random"})
    for frame in range(FRAMES):
        observations, rewards, *_, info = env.step(player.actions(observations))
        assert np.isfinite(rewards).all() and np.isfinite(info["gospa"]).all()
        if frame % 10 == 0:
            check(env)
    env.close()
    return WORLDS * FRAMES


def main(frames: int) -> None:
    played, seed, failures = 0, 0, list[str]()
    while played < frames:
        seed += 1
        try:
            played += _play(seed)
        except Exception as fault:
            played += 1
            failures.append(f"seed {seed}: {type(fault).__name__}: {fault}".replace("\n", " "))
    print("\n".join([str(played), *failures]))


if __name__ == "__main__":
    main(int(sys.argv[1]))
