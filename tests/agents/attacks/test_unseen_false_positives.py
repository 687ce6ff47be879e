"""Phantoms that no honest agent sees: who sees them, how they move, and what becomes of trust in them."""

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


def places(env: VectorEnv) -> np.ndarray:
    """The injected points, far away where there is none."""
    points = injected(env)
    return np.where(np.isnan(points), 1e6, points)


class TestExclusive:
    def test_no_honest_agent_sees_a_phantom(self) -> None:
        for env, _ in play(PATROL, "exclusive(hit_rate=1, noise=0)", 2, 40):
            assert (observers(env, places(env), "benign") == 0).all()
            assert (~np.isnan(injected(env)[..., 0])).sum() > 0.9 * 40 * 8

    def test_nor_another_adversary_where_that_is_possible(self) -> None:
        apart = quiet(
            [{"role": "adversary", "position": [x, 0.0]} for x in (-60.0, 60.0)]
            + [{"role": "benign", "position": [0.0, 60.0]}],
            knowledge="poses",
        )
        for env, _ in play(load_scenario(apart), "exclusive(n=3, hit_rate=1, noise=0)", 2, 20):
            points = injected(env)
            there = ~np.isnan(points[..., 0])
            assert there.sum() == 120 and (observers(env, places(env), "adversary")[there] == 1).all()

    def test_a_track_that_one_agent_watches_keeps_its_prior_and_is_shown(self) -> None:
        env = VectorEnv(PATROL, "trust", 20, autoreset=False)
        player = Player(env, {"adversary": "exclusive"})
        seen, _ = env.reset(3)
        for _ in range(60):
            seen, *_ = env.step(player.actions(seen))
        a = env.arrays
        watchers = a.expected.sum(axis=1)
        lone = a.track_injected & (a.track_status == 2) & (watchers == 1)
        prior = a.track_trust[lone]
        assert lone.sum() > 40 and np.isclose(prior, 0.5).mean() > 0.8 and a.published[lone].mean() > 0.8


class TestStealth:
    def test_phantoms_move_at_target_speed_where_no_honest_agent_sees(self) -> None:
        policy: Any = build_policy("stealth(hit_rate=1, noise=0)")
        path = []
        for env, _ in play(PATROL, policy, 40, 20):
            assert (observers(env, places(env), "benign") == 0).all()
            path.append(policy.position[policy.reports.any(axis=1)[:, None]])
        steps = np.linalg.norm(np.diff(path, axis=0), axis=-1)
        moving = steps[steps > 1e-2]
        assert moving.size > 0.99 * steps.size and moving.min() > 3.0 - 1e-6 and moving.max() < 12.0 + 1e-6

    def test_each_reports_with_the_probability_of_its_sensor(self) -> None:
        policy: Any = build_policy("stealth")
        fired = 0
        for env, _ in play(PATROL, policy, 60, 20):
            fired += (~np.isnan(injected(env)[:, :2, :, 0])).sum()
        looks = 60 * policy.reports.sum()
        assert looks > 60 * 20 * 6 and abs(fired / looks - 0.9) < 0.02

    def test_its_tracks_are_shown_and_its_agents_not_found(self) -> None:
        found = evaluate(PATROL, "stealth(n=4),false_positive", "trust", episodes=20, progress=False)
        stealth, crude = (found[name, "trust"].summary for name in ("stealth(n=4)", "false_positive"))
        assert stealth["damage_per_frame"].iqm > 3.0 * crude["damage_per_frame"].iqm
        assert stealth["adversary_auroc"].iqm < 0.8 < crude["adversary_auroc"].iqm
