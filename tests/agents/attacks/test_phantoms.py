"""What all attacks with phantoms share: noise, motion, suppression, and phantoms that have no place."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from attack_runs import injected, play, quiet

from trust_env.agents import POLICIES, build_policy
from trust_env.agents.attacks.motion import step
from trust_env.agents.attacks.phantom_parameters import SHARED_PARAMETERS
from trust_env.agents.attacks.phantoms import Phantoms
from trust_env.scenario import load_scenario
from trust_env.training import evaluate

pytestmark = pytest.mark.core

ALONE = [{"role": "adversary", "position": [0.0, 0.0]}]


class TestNoise:
    def deviations(self, attack: str, sensor: dict[str, object] | None = None, worlds: int = 60) -> np.ndarray:
        """Reports of a static phantom from its mean over 30 frames, [frames, W, 2]."""
        agents = [{"role": "adversary", "position": [0.0, 0.0], "sensor": sensor or {}}, {"role": "benign"}]
        world = {"base": "patrol", "agents": agents, "knowledge": "poses"}
        path = np.array(
            [np.nanmean(injected(env)[:, 0], axis=1) for env, _ in play(load_scenario(world), attack, 30, worlds)]
        )
        inside = np.abs(path[0]).max(axis=-1) < 200.0  # far from the rim, to which reports are moved
        return (path - path.mean(axis=0))[:, inside] * math.sqrt(30 / 29)

    @pytest.mark.parametrize(("noise", "sigma"), [("None", 5.0), ("12.0", 12.0), ("0", 0.0)])
    def test_reports_have_the_noise_asked_for(self, noise: str, sigma: float) -> None:
        found = self.deviations(f"false_positive(n=1, hit_rate=1, noise={noise})")
        size = found.size / 2
        assert size > 500
        np.testing.assert_allclose(found.std(axis=(0, 1)), sigma, atol=max(1e-4, 4 * sigma / math.sqrt(2 * size)))

    def test_none_is_the_covariance_of_the_own_sensor(self) -> None:
        found = self.deviations("false_positive(n=1, hit_rate=1)", {"noise_cov": [[100.0, 60.0], [60.0, 49.0]]})
        cov = np.cov(found.reshape(-1, 2).T)
        np.testing.assert_allclose(cov, [[100.0, 60.0], [60.0, 49.0]], atol=12.0)

    def test_no_frame_repeats_the_noise_of_another_or_of_another_slot(self) -> None:
        found = self.deviations("false_positive(n=1, hit_rate=1)")
        x, y = found[..., 0], found[..., 1]
        for a, b in ((x[1:], x[:-1]), (x, y)):
            assert abs(np.corrcoef(a.reshape(-1), b.reshape(-1))[0, 1]) < 0.12


class TestMotion:
    def test_a_pacing_phantom_keeps_its_speed_and_stays_in_its_zone(self) -> None:
        """On a line of 10 m at 3 m/s: at 1, 4, 7, 10, and back."""
        position, velocity, path = np.array([[1.0, 0.0]]), np.array([[3.0, 0.0]]), [1.0]

        def on_the_line(points: np.ndarray, rows: object) -> np.ndarray:
            return (points[:, 0] >= 0.0) & (points[:, 0] <= 10.0)

        for _ in range(6):
            position, velocity, left = step("pace", position, velocity, lambda _: np.array([0.5]), 1.0, on_the_line)
            path.append(float(position[0, 0]))
            assert not left.any()
        np.testing.assert_allclose(path, [1, 4, 7, 10, 7, 4, 1], atol=1e-12)

    def test_pacing_phantoms_turn_at_the_edge_of_the_fov(self) -> None:
        path, place = [], np.zeros((10, 1, 2))
        for env, _ in play("trio", "false_positive(n=2, hit_rate=1, motion=pace, speed=30, noise=0)", 60, 10):
            points, place = injected(env)[:, 0], env.arrays.pose[:, 0, None, :2].copy()
            path.append(points[~np.isnan(points[..., 0])].reshape(10, 2, 2))
        length = np.linalg.norm(np.diff(path, axis=0), axis=-1)
        assert (np.abs(length - 30.0) < 1e-2).mean() > 0.98 and length.max() < 30.0 + 1e-2
        assert np.linalg.norm(np.array(path) - place, axis=-1).max() < 350.01

    def test_shared_phantoms_stay_where_all_their_reporters_see_them(self) -> None:
        policy: Any = build_policy("fov_aware(n=3, hit_rate=1, noise=0, motion=constant_velocity, speed=40)")
        counts = []
        for env, _ in play(load_scenario("patrol", knowledge="poses"), policy, 40, 20):
            points = injected(env)[:, :2]
            counts.append((~np.isnan(points[..., 0])).sum(axis=-1))
            for w in range(20):
                found = points[w, ~np.isnan(points[w, ..., 0])]
                apart = np.linalg.norm(found[:, None] - policy.position[w, 0], axis=-1)
                assert apart.min(axis=1).max() < 1e-2  # as reported, not moved to a rim
        np.testing.assert_array_equal(counts, np.broadcast_to(counts[0], np.shape(counts)))
        assert (counts[0] == 3).mean() > 0.7


class TestSuppression:
    def test_the_given_fraction_of_the_own_detections_is_withheld_from_start_on(self) -> None:
        withheld = np.zeros(3)
        for attack, slot in (("0", 0), ("0.4", 1), ("1", 2)):
            shares = []
            for frame, (_, actions) in enumerate(play("patrol", f"false_positive(suppress={attack}, start=5)", 25, 20)):
                drop = (actions[:, :2, 12:] > 0).sum(axis=-1)
                assert frame >= 5 or not drop.any()
                shares.append(drop)
            withheld[slot] = np.mean(shares[5:])
        assert withheld[0] == 0.0 and withheld[2] > 2.0
        assert abs(withheld[1] / withheld[2] - 0.4) < 0.05


class TestMissing:
    APART = quiet(
        [{"role": "adversary", "position": [0.0, 0.0]}, {"role": "benign", "position": [0.0, 0.0]}], knowledge="poses"
    )

    def test_as_many_phantoms_as_slots_of_all_are_as_many_tracks(self) -> None:
        """Four slots each: eight phantoms are eight places, each reported by one of the two."""
        scenario = load_scenario("patrol", knowledge="poses")
        for env, _ in play(scenario, "fov_aware(n=8, hit_rate=1, noise=0)", 1, 30):
            points = injected(env)[:, :2]
            assert (~np.isnan(points[..., 0])).sum() == 30 * 8
            for world in points:
                places = world[~np.isnan(world[..., 0])].round(3)
                assert len(np.unique(places, axis=0)) == 8

    def test_slots_that_are_left_report_the_phantoms_of_others(self) -> None:
        scenario = load_scenario("patrol", knowledge="poses")
        for env, _ in play(scenario, "fov_aware(n=6, hit_rate=1, noise=0)", 1, 30):
            points = injected(env)[:, :2]
            counts = [len(np.unique(w[~np.isnan(w[..., 0])].round(2), axis=0)) for w in points]
            assert counts == [6] * 30

    def test_phantoms_without_a_place_are_counted(self) -> None:
        policy: Any = build_policy("fov_aware(n=3, max_honest=0)")
        *_, (env, _) = play(load_scenario(self.APART), policy, 2, 4)
        assert policy.missing_phantoms.tolist() == [3] * 4 and (env.arrays.report_count[:, 0] == 0).all()
        seen: Any = build_policy("fov_aware(n=3)")
        *_, (env, _) = play(load_scenario(self.APART), seen, 2, 4)
        assert seen.missing_phantoms.tolist() == [0] * 4

    def test_a_budget_below_n_is_counted_and_none_fills_every_budget(self) -> None:
        agents = [{"role": "adversary", "budget": {"injections": 1}}, {"role": "adversary"}, {"role": "benign"}]
        scenario = load_scenario({"base": "patrol", "agents": agents})
        for attack, missing in (("false_positive(n=3)", 2), ("false_positive", 0), ("outward(n=2)", 1)):
            policy: Any = build_policy(attack)
            next(play(scenario, policy, 1, 2))
            assert policy.missing_phantoms.tolist() == [missing] * 2

    def test_an_evaluation_notes_phantoms_without_a_place(self) -> None:
        attacks = "fov_aware(n=3, max_honest=0),sleeper(inner=fov_aware(n=2, max_honest=0)),honest,fov_aware(n=1)"
        found = evaluate(self.APART, attacks, "score", episodes=3, max_cycles=2, progress=False)
        notes = [note for note in found.notes if "have no place" in note]
        assert len(notes) == 2
        assert notes[0].startswith("fov_aware(n=3, max_honest=0): 3 of its phantoms an episode have no place (3 of 3")
        assert notes[1].startswith("sleeper(inner=fov_aware(n=2, max_honest=0)): 2 of its phantoms")


def test_every_attack_with_phantoms_explains_its_shared_parameters() -> None:
    for policy in POLICIES.values():
        if issubclass(policy, Phantoms):
            known = set(vars(build_policy(policy.name))) & set(SHARED_PARAMETERS)
            lines = (policy.__doc__ or "").splitlines()
            explained = {name for name in SHARED_PARAMETERS if any(line.startswith(f"{name:<12} ") for line in lines)}
            assert explained <= known and {"motion", "noise", "hit_rate", "start", "suppress"} <= explained
