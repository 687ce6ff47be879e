"""More phantoms than slots: the forecast of their tracks, the order of reports, and the damage."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from attack_runs import injected, observers, play, quiet

from trust_env.agents import Player, build_policy
from trust_env.scenario import load_scenario
from trust_env.training import evaluate
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core

PATROL = load_scenario("patrol", knowledge="poses")


def test_the_forecast_is_the_score_that_the_tracker_keeps() -> None:
    """One adversary that nobody contradicts: the same scores, frame by frame, noise and missed reports included."""
    world = quiet([{"role": "adversary", "position": [0.0, 0.0]}], knowledge="poses")
    world = load_scenario(world, **{"sensor.sigma": 2.0, "tracker.gate": 0.9999, "injection.slots": 2})
    env = VectorEnv(world, "score", 3)
    policy: Any = build_policy("by_turns(per_slot=2, noise=None, spacing=30)")
    player, agree = Player(env, {"adversary": policy}), list[bool]()
    seen, _ = env.reset(1)
    for _ in range(40):
        seen, *_ = env.step(player.actions(seen))
        for w in range(3):
            kept = np.sort(env.arrays.track_score[w, env.arrays.track_status[w] == 2])
            expected = np.sort(policy.forecast.score[w, 0, policy.forecast.confirmed[w, 0]])
            if kept.size == expected.size:
                agree += np.isclose(kept, expected, atol=1e-3).tolist()
    # The others had a report beyond the rim, which was moved to it.
    assert len(agree) > 300 and np.mean(agree) > 0.85


def test_phantoms_are_apart_and_out_of_sight_of_honest_agents() -> None:
    policy: Any = build_policy("by_turns")
    for env, _ in play(PATROL, policy, 1, 30):
        position, placed = policy.position, policy.reports
        assert (observers(env, np.where(placed[..., None], position, 1e6), "benign") == 0).all()
        assert position.shape == (30, 2, 12, 2) and placed.mean() > 0.8
        near = []
        for w in range(30):
            points = position[w][placed[w]]
            apart = np.linalg.norm(points[:, None] - points, axis=-1) + 1e6 * np.eye(len(points))
            near.append((apart.min(axis=1) < 50.0).mean())
        assert np.median(near) == 0.0 and np.mean(near) < 0.25  # in some episodes there is no room


def test_no_more_is_reported_than_the_budget_allows_and_all_get_their_turn() -> None:
    policy: Any = build_policy("by_turns")
    reported = []
    for env, _ in play(PATROL, policy, 60, 10):
        there = ~np.isnan(injected(env)[:, :2, :, 0])
        assert there.sum(axis=-1).max() <= 4
        reported.append(policy.forecast.confirmed.copy())
    alive = np.array(reported)[30:].mean(axis=0)  # share of the last 30 frames in which a phantom has a track
    assert (alive[policy.reports] > 0.5).mean() > 0.7


def test_it_does_nearly_twice_the_damage_of_a_phantom_a_slot() -> None:
    found = evaluate(PATROL, "by_turns,exclusive", "score,trust", episodes=20, progress=False)
    keys = [("by_turns", "score"), ("by_turns", "trust"), ("exclusive", "score")]
    damage = {key: found[key].summary["damage_per_frame"].iqm for key in keys}
    assert damage["by_turns", "score"] > 15.0 and damage["by_turns", "trust"] > 13.0
    assert damage["by_turns", "score"] > 1.8 * damage["exclusive", "score"]
