"""False positives of every adversary on its own: where, when and how they move."""

from __future__ import annotations

import math

import numpy as np
import pytest
from attack_runs import injected, play

from trust_env.scenario import load_scenario

pytestmark = pytest.mark.core


class TestFalsePositive:
    def test_case_1_shows_its_two_false_tracks(self) -> None:
        scenario = load_scenario("case1")
        *_, (env, _) = play(scenario, "false_positive", 20)
        shown = env.arrays.published[0] & env.arrays.track_injected[0]
        found = env.arrays.track_mean[0, shown, :2]
        listed = np.array([case.position for case in scenario.injections])
        assert shown.sum() == 2 and env.arrays.published[0].sum() == 6
        np.testing.assert_allclose(found[np.argsort(found[:, 0])], listed[np.argsort(listed[:, 0])], atol=1e-5)

    def test_listed_injections_are_replayed_by_agent_whatever_n(self) -> None:
        for name in ("case1", "case2"):
            scenario = load_scenario(name)
            for env, _ in play(scenario, "false_positive(n=7, motion=random_walk)", 3, 2):
                for k in range(3):
                    listed = [case.position for case in scenario.injections if case.agent == k]
                    points = injected(env)[1, k]
                    points = points[~np.isnan(points[:, 0])]
                    np.testing.assert_allclose(points, np.array(listed).reshape(-1, 2), atol=1e-6)

    def test_phantoms_are_uniform_in_the_own_fov(self) -> None:
        *_, (env, _) = play("patrol", "false_positive(hit_rate=1)", 1, 200)
        offset = injected(env)[:, :2] - env.arrays.pose[:, :2, None, :2]
        share = np.linalg.norm(offset, axis=-1) ** 2 / 350.0**2
        share = share[~np.isnan(share)]
        assert share.size == 200 * 2 * 4 and share.max() <= 1.0
        # A uniform share has mean 1/2 and standard deviation 1/sqrt(12).
        assert abs(share.mean() - 0.5) < 5 / math.sqrt(12 * share.size)
        assert abs(np.nanmean(offset)) < 5 * 175.0 / math.sqrt(share.size)

    def test_phantoms_are_reported_with_the_hit_rate(self) -> None:
        for attack, rate in (("false_positive", 0.9), ("false_positive(hit_rate=0.3)", 0.3)):
            fired = [(a[:, :2, :12:3] > 0).mean() for _, a in play("patrol", attack, 25, 40)]
            size = 25 * 40 * 2 * 4
            assert abs(np.mean(fired) - rate) < 5 * math.sqrt(rate * (1 - rate) / size)
        agents = [{"role": "adversary"}, {"role": "adversary", "sensor": {"p_detect": 0.5}}]
        fired = [a[..., :12:3] > 0 for _, a in play({"base": "patrol", "agents": agents}, "false_positive", 25, 40)]
        np.testing.assert_allclose(np.mean(fired, axis=(0, 1, 3)), [0.9, 0.5], atol=0.05)

    def test_start_and_period_pick_the_frames(self) -> None:
        run = play("trio", "false_positive(n=1, start=2, period=3, hit_rate=1)", 10)
        assert [int((a[0, 0, :6:3] > 0).sum()) for _, a in run] == [0, 0, 1, 0, 0, 1, 0, 0, 1, 0]

    def paths(self, attack: str, frames: int = 40, worlds: int = 20) -> tuple[np.ndarray, np.ndarray]:
        """Two phantoms of each adversary, [frames, W, n, P, 2], and the agents' places, [W, n, 1, 2]."""
        path, place = np.zeros((frames, worlds, 2, 2, 2)), np.zeros((worlds, 2, 1, 2))
        for frame, (env, _) in enumerate(play("patrol", attack, frames, worlds)):
            points, place = injected(env)[:, :2], env.arrays.pose[:, :2, None, :2].copy()
            path[frame] = points[~np.isnan(points[..., 0])].reshape(worlds, 2, 2, 2)
        return path, place

    def test_static_phantoms_stay(self) -> None:
        path, _ = self.paths("false_positive(n=2, noise=0, hit_rate=1)", 5)
        np.testing.assert_allclose(path, np.broadcast_to(path[0], path.shape), atol=1e-4)

    def test_phantoms_of_constant_velocity_move_straight_until_they_leave_the_fov(self) -> None:
        path, place = self.paths("false_positive(n=2, noise=0, hit_rate=1, motion=constant_velocity, speed=20)")
        assert (np.linalg.norm(path - place, axis=-1) <= 350.0).all()
        steps = np.diff(path, axis=0)
        length = np.linalg.norm(steps, axis=-1)
        stays = np.abs(length - 20.0) < 1e-3  # 20 m/s for 1 s
        assert 0.85 < stays.mean() < 1.0
        straight = stays[1:] & stays[:-1]
        np.testing.assert_allclose(steps[1:][straight], steps[:-1][straight], atol=1e-3)
        gone = ~stays[1:] & stays[:-1]  # replaced where the next step would have led out
        onward = np.linalg.norm(path[1:-1] + steps[:-1] - place, axis=-1)
        assert gone.sum() > 100 and (onward[gone] > 350.0 - 1e-3).all()
        assert (onward[straight] < 350.0 + 1e-3).all()

    def test_random_walk_takes_steps_of_the_given_speed(self) -> None:
        path, place = self.paths("false_positive(n=2, noise=0, hit_rate=1, motion=random_walk, speed=20)")
        assert (np.linalg.norm(path - place, axis=-1) <= 350.0).all()
        steps = np.diff(path, axis=0)
        length = np.linalg.norm(steps, axis=-1)
        moved = length > 1.0
        np.testing.assert_allclose(length[moved], 20.0, atol=1e-3)
        assert length[~moved].max(initial=0.0) < 1e-3 and 0.9 < moved.mean() < 1.0
        turns = (steps[1:] * steps[:-1]).sum(axis=-1)[moved[1:] & moved[:-1]] / 400.0
        assert abs(turns.mean()) < 5 / math.sqrt(2 * turns.size)  # the mean cosine of a uniform turn is 0

    def test_default_speeds_are_those_of_targets(self) -> None:
        path, _ = self.paths("false_positive(n=2, noise=0, hit_rate=1, motion=constant_velocity)", 2, 60)
        speed = np.linalg.norm(path[1] - path[0], axis=-1)
        speed = speed[speed < 30.0]  # the others are new
        assert 3.0 - 1e-3 < speed.min() < 3.5 and 11.5 < speed.max() < 12.0 + 1e-3


class TestBurst:
    def test_tracks_are_confirmed_coast_and_die(self) -> None:
        shown, reported = [], []
        for env, _ in play("patrol", "burst(frames=8, start=3)", 40, 40):
            shown.append((env.arrays.published & env.arrays.track_injected).sum(axis=1).mean())
            reported.append((~np.isnan(injected(env)[..., 0])).sum(axis=(1, 2)).mean())
        assert max(reported[:3] + reported[11:]) == 0.0 and min(reported[3:11]) > 6.0
        assert max(shown[3:11]) > 1.5 and shown[12] > 0.7  # two frames after the last report
        assert max(shown[25:]) < 0.05
