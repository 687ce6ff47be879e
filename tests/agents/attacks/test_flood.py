"""As many detections as a frame holds: how many, where, and how many tracks they start."""

from __future__ import annotations

import numpy as np
import pytest
from attack_runs import injected, play

pytestmark = pytest.mark.core


def tracks_per_frame(attack: str, scenario: str = "patrol") -> tuple[float, float]:
    """Tracks of the centre, and false ones it shows, means over frames 20 to 39 of 20 worlds."""
    counts = [
        ((env.arrays.track_status > 0).sum(axis=1).mean(), env.arrays.injected_tracks.mean())
        for env, _ in play(scenario, attack, 40, 20)
    ]
    held, shown = np.mean(counts[20:], axis=0)
    return float(held), float(shown)


def test_every_slot_is_filled_anew_in_every_frame() -> None:
    run = [injected(env)[:, :2].copy() for env, _ in play("patrol", "flood", 5, 10)]
    points = np.array([frame[~np.isnan(frame[..., 0])].reshape(10, 8, 2) for frame in run])
    assert len(np.unique(points.reshape(-1, 2).round(3), axis=0)) == 5 * 10 * 8


def test_it_fills_the_tracker() -> None:
    held, _ = tracks_per_frame("flood")
    honest, _ = tracks_per_frame("honest")
    assert held > honest + 8.0


def test_a_stack_is_one_place_and_many_tracks_unless_the_sensor_cannot_resolve_it() -> None:
    for env, _ in play("patrol", "flood(stack=True)", 3, 10):
        points = injected(env)[:, :2]
        points = points[~np.isnan(points[..., 0])].reshape(10, 2, 4, 2)
        np.testing.assert_allclose(points, np.broadcast_to(points[:, :, :1], points.shape), atol=1e-6)
    _, stacked = tracks_per_frame("flood(stack=True)")
    _, resolved = tracks_per_frame("flood(stack=True)", "patrol(sensor.resolution=10)")
    assert stacked > 5.0 and resolved < 2.1  # two adversaries, a place each
