"""Old detections once more: which, when, and what becomes of them."""

from __future__ import annotations

import numpy as np
import pytest
from attack_runs import injected, play, quiet

from trust_env.scenario import load_scenario
from trust_env.training import evaluate

pytestmark = pytest.mark.core


def test_a_detection_is_repeated_after_lag_frames() -> None:
    """A target at 2 m/s: its ghost is five frames, 10 m, behind it."""
    target = {"positions": [[-30.0, 0.0]], "velocities": [[2.0, 0.0]]}
    world = load_scenario(quiet([{"role": "adversary", "position": [0.0, 0.0]}], targets=target))
    raw, ghosts = [], []
    for env, _ in play(world, "replay(lag=5)", 20, 3):
        raw.append(env.arrays.report_detections[:, 0, 0].copy())
        points = injected(env)[:, 0]
        ghosts.append(np.nansum(points, axis=1))
    assert not np.any(ghosts[:5])
    np.testing.assert_allclose(ghosts[5:], raw[:-5], atol=1e-3)


def test_targets_get_ghosts_behind_them_on_patrol() -> None:
    found = evaluate("patrol", "replay,replay(lag=1),honest", "score", episodes=20, progress=False)
    tail, near, honest = (cell.summary["injected_tracks_per_frame"].iqm for cell in found.cells)
    assert tail > 2.0 and honest == 0.0 and tail > near
