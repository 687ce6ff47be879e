"""What worlds give under fixed actions, as sums: recorded once, so that a redesign moves behaviour nowhere.

python tests/same_worlds.py > tests/reference/same_worlds.json    # after a change of behaviour that is meant
"""

from __future__ import annotations

import itertools
import json
import sys
import tempfile
from pathlib import Path

import numpy as np

import trust_env

DEFENSES = ("score", "trust", "trust(preset=cdc2024)", "trust(preset=mate)", "majority")
SCENARIOS = ("case1", "case2", "theorem", "patrol", "trio", "crowd", "skies")
SECTOR = "{'type': 'sector', 'radius': 400.0, 'width': 1.6}"
POLYGON = "{'type': 'polygon', 'vertices': [[0, -200], [300, 0], [0, 200]]}"
VARIANTS = (
    "patrol(actuation=remove)", "patrol(actuation=weight)", "patrol(confirmation=m_of_n)",
    "patrol(deletion=relative)", "patrol(knowledge=white_box, coordination=shared)", "patrol(max_tracks=6)",
    f"patrol(fov={SECTOR})", f"patrol(fov={POLYGON})", "patrol(metrics.order=1.5)",
)  # fmt: skip
CASES = [*itertools.product(SCENARIOS, DEFENSES), *itertools.product(VARIANTS, ("trust", "majority(window=4)"))]
WORLDS, FRAMES, HORIZON = 4, 30, 20


def name_of(case: tuple[str, str]) -> str:
    return " x ".join(case)


def write_traffic(path: Path) -> Path:
    """Forty aircraft on straight lines, with gaps."""
    rng = np.random.default_rng(7)
    start, velocity = rng.uniform(-2e5, 2e5, (40, 2)), rng.normal(0.0, 150.0, (40, 2))
    rows = ["t,id,x,y"]
    for t, n in itertools.product(range(40), range(40)):
        if (t + n) % 17:
            x, y = start[n] + velocity[n] * 10 * t
            rows.append(f"{10 * t},a{n},{x:.3f},{y:.3f}")
    path.write_text("\n".join(rows) + "\n")
    return path


def sums(case: tuple[str, str], folder: Path) -> dict[str, float]:
    """Sums of observations, rewards, metrics and trust over some frames of some worlds, automatic resets included."""
    scenario, defense = case
    if scenario == "skies":
        scenario = f"skies(data={str(write_traffic(folder / 'traffic.csv'))!r})"
    frames = 8 if scenario == "crowd" else FRAMES
    env = trust_env.vector_env(scenario, defense, num_worlds=WORLDS, max_cycles=HORIZON)
    rng = np.random.default_rng(11)
    total = dict.fromkeys(("observations", "rewards", "gospa", "false_tracks", "missing_targets", "agent_trust"), 0.0)
    observations, info = env.reset(seed=3)
    shape = (WORLDS, len(env.possible_agents), env.single_action_space.shape[0])
    phantoms = rng.uniform(-1.0, 1.0, shape)  # reported at the same place for a while, so that they make tracks
    for frame in range(frames):
        phantoms = rng.uniform(-1.0, 1.0, shape) if frame % 7 == 0 else phantoms
        actions = np.where(rng.random(shape) < 0.9, phantoms, rng.uniform(-1.0, 1.0, shape))
        actions[..., -env.scenario.sensor.max_detections :] -= 0.8
        observations, rewards, _, _, info = env.step(actions)
        total["observations"] += float((observations * (1.0 + frame)).sum(dtype=np.float64))
        total["rewards"] += float((rewards * (1.0 + frame)).sum())
        for name in list(total)[2:]:
            total[name] += float(np.nansum(info[name] * (1.0 + frame)))
    return total


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        found = {name_of(case): sums(case, Path(folder)) for case in CASES}
    json.dump(found, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
