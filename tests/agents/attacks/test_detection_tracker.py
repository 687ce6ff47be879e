"""The detection tracker: which targets detections are assigned to."""

from __future__ import annotations

import numpy as np
import pytest
from attack_runs import quiet

from trust_env.agents.attacks.detection_tracker import PATIENCE, DetectionTracker
from trust_env.scenario import load_scenario

pytestmark = pytest.mark.core


def test_a_target_survives_misses_and_is_dropped_after_patience() -> None:
    scenario = load_scenario(quiet([{"role": "adversary", "position": [0.0, 0.0]}]))
    tracker = DetectionTracker(scenario, np.array([0]), 1)
    points, there = np.zeros((1, 1, 8, 2)), np.zeros((1, 1, 8), dtype=bool)
    there[..., :2] = True

    def look(t: float, *order: int) -> list[int]:
        path = [(3.0 * t, 0.0), (60.0, -3.0 * t)]
        for d, target in enumerate(order):
            points[0, 0, d] = path[target]
        mask = there & (np.arange(8) < len(order))
        return tracker.update(points, mask)[0][0, 0, : len(order)].tolist()

    tracker.velocity_variance = 9.0
    assert look(0, 0, 1) == [0, 1]
    assert look(1, 1, 0) == [1, 0]
    assert look(2, 0) == [0]
    assert look(3, 1) == [1]
    for t in range(4, 4 + PATIENCE):
        look(t)
    # Missed for PATIENCE + 1 frames: dropped, and found again in the same slot.
    assert look(4 + PATIENCE, 0) == [0]
    assert tracker.alive.sum() == 1


def test_detections_are_paired_greedily_by_distance() -> None:
    """Greedy, the least first: 2 at 1 m, 10 at 3 m; the detection at 0 gets what is left."""
    sensor = {"sigma": 10.0, "noise_cov": None, "p_detect": 1.0, "clutter_density": 0.0, "max_detections": 4}
    scenario = load_scenario(quiet([{"role": "adversary", "position": [0.0, 0.0]}], sensor=sensor))
    tracker = DetectionTracker(scenario, np.array([0]), 1)
    points, mask = np.zeros((1, 1, 4, 2)), np.array([[[True, True, False, False]]])
    points[0, 0, :2, 0] = 1.0, 7.0
    assert tracker.update(points, mask)[0][0, 0].tolist()[:2] == [0, 1]
    points[0, 0, :3, 0] = 0.0, 2.0, 10.0
    mask[..., 2] = True
    slot, new = tracker.update(points, mask)
    assert (slot[0, 0, :3].tolist(), new[0, 0, :3].tolist()) == ([0, 2, 1], [False, True, False])
