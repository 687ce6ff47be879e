"""Simulations behind two statements about tracks: clutter in a gate, and the printed test for deletion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trust_env.scenario import load_scenario
from trust_env.training.paper.published import objects
from trust_env.vector import VectorEnv

GATE_RADIUS, CLUTTER = 4.5, 1.5e-3  # m, and per m²: about one gate in ten holds a false positive
_WORLDS, _FRAMES = 256, 20


class GateCount(NamedTuple):
    """Scans with a natural false positive in a planar gate, of all scans."""

    hits: int
    scans: int


def clutter_in_a_gate() -> GateCount:
    """How many scans of three honest agents put clutter into a circular gate about the agent."""
    changes = {"fov.radius": 20.0, "sensor.clutter_density": CLUTTER, "sensor.max_detections": 32}
    venv = VectorEnv(load_scenario("theorem", n_adversaries=0, n_benign=3, **changes), "score", _WORLDS, _FRAMES)
    a, hits = venv.arrays, 0
    venv.reset(seed=0)
    idle = np.zeros((_WORLDS, 3, venv.action_table.size), dtype=np.float32)
    for _ in range(_FRAMES):
        distance = np.linalg.norm(a.raw_detections - a.pose[:, :, None, :2], axis=-1)  # [W, K, D]
        listed = np.arange(distance.shape[2]) < a.raw_count[..., None]
        hits += int(((distance < GATE_RADIUS) & listed).any(axis=2).sum())
        venv.step(idle)
    venv.close()
    return GateCount(hits, 3 * _WORLDS * _FRAMES)


def observers_of_tracked_targets(deletion: str) -> tuple[list[int], list[int]]:
    """Of case 1's targets, by how many agents see them: those with a track at the end, and those without.

    deletion: the rule, as the scenario names it. All agents are honest.
    """
    venv = VectorEnv(load_scenario("case1", deletion=deletion), "score", 1, autoreset=False)
    venv.reset(seed=0)
    for _ in range(venv.max_cycles):
        venv.step(np.zeros((1, 3, venv.action_table.size), dtype=np.float32))
    a, tracked, untracked = venv.arrays, [], []
    tracks = a.track_mean[0, a.track_status[0] > 0, :2]
    for target in (obj for obj in objects("case1") if obj.kind == "true"):
        near = np.linalg.norm(tracks - np.array(target.position), axis=1) < venv.scenario.metrics.match_distance
        (tracked if near.any() else untracked).append(len(target.in_fov_of))
    venv.close()
    return sorted(tracked), sorted(untracked)
