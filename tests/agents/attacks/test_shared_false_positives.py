"""Shared false positives: Theorem 1 in the simulation, and where phantoms are placed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from attack_runs import injected, observers, play, quiet

from trust_env.scenario import load_scenario
from trust_env.theory import score_optimal_frames

pytestmark = pytest.mark.core


class TestTheorem:
    """Theorem 1 of Hallyburton & Pajic 2024 against the simulation."""

    TEAMS = ((1, 0), (1, 1), (1, 2), (1, 3), (1, 4), (1, 5), (2, 0), (2, 3), (2, 4), (2, 6), (3, 0), (3, 3))

    @pytest.mark.parametrize("order", ["adversaries_first", "adversaries_last"])
    @pytest.mark.parametrize("team", TEAMS, ids=str)
    def test_the_injected_track_is_confirmed_in_exactly_that_frame(self, team: tuple[int, int], order: str) -> None:
        text = f"theorem(n_adversaries={team[0]}, n_benign={team[1]}, order={order})"
        scenario, worlds = load_scenario(text), 3
        expected = score_optimal_frames(scenario.roles)
        horizon = 25 if math.isinf(expected) else int(expected)
        for frame, (env, _) in enumerate(play(scenario, "optimal_false_positive", horizon, worlds), start=1):
            confirmed = ((env.arrays.track_status == 2) & env.arrays.track_injected).sum(axis=1)
            shown = (env.arrays.published & env.arrays.track_injected).sum(axis=1)
            assert list(confirmed) == [int(frame >= expected)] * worlds
            np.testing.assert_array_equal(shown, confirmed)

    def test_the_theory_gives_the_known_frames(self) -> None:
        first = [score_optimal_frames("A" + "B" * k) for k in range(6)]
        assert first == [3, 4, 5, 8, 17, math.inf]

    def test_every_innovation_is_zero(self) -> None:
        for env, _ in play("theorem(n_adversaries=2, n_benign=0)", "optimal_false_positive", 5, 4):
            points = injected(env)[:, :2, 0]
            np.testing.assert_allclose(points[:, 0], points[:, 1], atol=1e-4)
            np.testing.assert_allclose(env.arrays.track_mean[:, 0, :2], points[:, 0], atol=1e-4)
            assert (env.arrays.track_count == 1).all()
            assert np.linalg.norm(points, axis=-1).max() < 96.0  # well inside the FOV, radius 100 m

    def test_start_is_the_number_of_honest_frames(self) -> None:
        counts = [env.arrays.report_count[0, 0] for env, _ in play("theorem", "optimal_false_positive(start=3)", 6)]
        assert counts == [0, 0, 0, 1, 1, 1]


class TestCoalition:
    APART = quiet(
        [
            {"role": "adversary", "position": [-300.0, 0.0]},
            {"role": "adversary", "position": [300.0, 0.0]},
            {"role": "benign", "position": [300.0, 50.0]},
        ],
        knowledge="poses",
    )

    def test_phantoms_are_shared_where_all_fovs_intersect(self) -> None:
        *_, (env, actions) = play("patrol", "optimal_false_positive", 1, 100)
        points = injected(env)
        assert (actions[:, :2, :12:3] > 0).all()
        first, second = (points[:, k][~np.isnan(points[:, k, :, 0])].reshape(100, 4, 2) for k in (0, 1))
        np.testing.assert_allclose(first, second, atol=1e-3)
        assert (observers(env, first, "adversary") == 2).all()
        assert len(np.unique(first.round(3).reshape(-1, 2), axis=0)) == 400

    def test_a_narrow_intersection_is_found(self) -> None:
        agents = [{"role": "adversary", "position": [x, 0.0]} for x in (-99.5, 99.5)]  # 1 m of 200 m is shared
        *_, (env, _) = play(quiet(agents), "optimal_false_positive(n=1)", 1, 50)
        points = injected(env)
        assert (~np.isnan(points[..., 0])).sum() == 100
        assert np.nanmax(np.abs(points[..., 0])) < 0.5 + 1e-3
        assert 0.3 < np.nanstd(points[..., 1]) / 5.0 < 1.5  # the lens is 20 m high

    def test_where_fovs_do_not_intersect_each_reports_its_own(self) -> None:
        for env, _ in play(self.APART, "optimal_false_positive(n=3)", 2, 30):
            points = injected(env)
            assert (~np.isnan(points[..., 0])).sum() == 90
            assert {int(n) for n in (~np.isnan(points[:, 0, :, 0])).sum(axis=1)} <= {0, 1, 2, 3}

    def test_fov_aware_avoids_the_fovs_of_honest_agents(self) -> None:
        for env, _ in play(self.APART, "fov_aware(n=3, hit_rate=1, noise=0)", 2, 30):
            points = injected(env)
            assert (~np.isnan(points[..., 0])).sum() == 90
            seen = observers(env, np.where(np.isnan(points), 1e6, points), "benign")
            assert (seen == 0).all()

    def test_fov_aware_is_seen_by_fewer_honest_agents_than_false_positive(self) -> None:
        scenario = load_scenario("patrol", knowledge="poses")
        mean = {}
        for attack in (
            "false_positive(hit_rate=1, noise=0)",
            "fov_aware(hit_rate=1, noise=0)",
            "fov_aware(max_honest=1, hit_rate=1, noise=0)",
        ):
            *_, (env, _) = play(scenario, attack, 1, 100)
            points = injected(env)[:, :2]
            there = ~np.isnan(points[..., 0])
            counts = observers(env, np.where(there[..., None], points, 1e6), "benign")[there]
            mean[attack] = counts.mean()
            assert "max_honest" not in attack or counts.max() == 1 or (counts == 0).all()
        assert mean["fov_aware(hit_rate=1, noise=0)"] < 0.5 * mean["false_positive(hit_rate=1, noise=0)"]

    def test_max_honest_limits_the_honest_agents_that_see_a_phantom(self) -> None:
        scenario = load_scenario("theorem", knowledge="poses")  # two honest agents at the same place see everything
        for limit, count in ((0, 0), (1, 0), (2, 1)):
            *_, (env, _) = play(scenario, f"fov_aware(max_honest={limit})", 1)
            assert env.arrays.report_count[0, 0] == count
