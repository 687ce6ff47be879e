"""Phantoms on the FOV's rim, away from the middle of the area."""

from __future__ import annotations

import math

import numpy as np
import pytest
from attack_runs import SHAPES, injected, play, quiet

from trust_env.scenario import Fovs, load_scenario
from trust_env.training import evaluate

pytestmark = pytest.mark.core


def test_phantoms_stand_where_worked_out_by_hand() -> None:
    """At (30, 40) in a square about 0 the outward bearing is atan2(4, 3)."""
    world = quiet([{"role": "adversary", "position": [30.0, 40.0]}], fov={"type": "circle", "radius": 100.0})
    (env, _), *_ = play(load_scenario(world), "outward(spread=0.2, n=3, hit_rate=1)", 1)
    bearing = math.atan2(4.0, 3.0)
    expected = [
        [30.0 + 100.0 * math.cos(bearing + turn), 40.0 + 100.0 * math.sin(bearing + turn)] for turn in (-0.2, 0.0, 0.2)
    ]
    points = injected(env)[0, 0]
    np.testing.assert_allclose(points[~np.isnan(points[:, 0])], expected, atol=1e-3)


def test_without_spread_all_stand_at_one_place() -> None:
    (env, _), *_ = play("patrol", "outward(spread=0, hit_rate=1)", 1, 5)
    points = injected(env)[:, :2]
    points = points[~np.isnan(points[..., 0])].reshape(5, 2, 4, 2)
    np.testing.assert_allclose(points, np.broadcast_to(points[:, :, :1], points.shape), atol=1e-6)


@pytest.mark.parametrize("shape", SHAPES)
def test_phantoms_stand_on_the_rim_of_any_fov(shape: str) -> None:
    agents = [{"role": "adversary"}, {"role": "benign"}]
    scenario = load_scenario({"base": "patrol", "agents": agents, "fov": SHAPES[shape]})
    (env, _), *_ = play(scenario, "outward(spread=0, n=1, hit_rate=1)", 1, 20)
    pose = env.observation_table.read(env.arrays.observation.copy(), np.arange(2))["pose"][:, :1]
    fovs = Fovs.of(scenario, np.arange(1))
    points = injected(env)[:, 0]
    points = points[~np.isnan(points[..., 0])].reshape(20, 1, 1, 2)
    ahead = points - fovs.middles(pose)[:, :, None]
    assert fovs.contains(pose, points - 1e-3 * ahead).all() and not fovs.contains(pose, points + 1e-3 * ahead).any()


def test_own_detections_are_withheld_and_no_poses_are_needed() -> None:
    for env, _ in play("patrol(knowledge=own)", "outward", 3, 5):
        honest = env.arrays.report_origin[:, :2] > -2
        there = np.arange(16) < env.arrays.report_count[:, :2, None]
        assert not (honest & there).any()


def test_it_does_twice_the_damage_of_false_positive_on_patrol() -> None:
    found = evaluate("patrol", "outward,false_positive", "score", episodes=20, progress=False)
    damage = {
        attack: found[attack, "score"].summary["damage_per_frame"].iqm for attack in ("outward", "false_positive")
    }
    assert damage["outward"] > 8.3 and damage["outward"] > 2.0 * damage["false_positive"]
