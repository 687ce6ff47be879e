"""Tracks and targets by who watches, by hand and against plain loops."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import trust_env
from trust_env.agents import Player
from trust_env.metrics import EpisodeMetrics
from trust_env.metrics.strata import merge_strata, sum_strata
from trust_env.metrics.track_record import Tracks, pack, unpack

NAN = float("nan")
pytestmark = pytest.mark.core


def tracks(*rows):
    """Tracks from (K_a, K_b, trust, is_target, shown_false, shown_injected)."""
    k_a, k_b, trust, is_target, false, injected = map(np.array, zip(*rows))
    none, yes = np.zeros(len(rows)), is_target.astype(bool)
    stratum = pack(np.stack([k_a, k_b], axis=1))
    return Tracks(none.astype(np.uint32), stratum, trust, none, yes, ~yes, false.astype(bool), injected.astype(bool))


def test_strata_by_hand():
    """Two adversaries and no benign agent: trusts 0.2, 0.6 of false tracks, 0.6 of a true one; one without opinion."""
    lone = (2, 0, 0.2, 0, 1, 1), (2, 0, 0.6, 0, 1, 0), (2, 0, 0.6, 1, 0, 0), (2, 0, NAN, 1, 0, 0)
    sums = sum_strata(tracks(*lone, (0, 3, 1.0, 1, 0, 0)), pack(np.array([[0, 3], [0, 3], [1, 1]])))
    assert list(sums) == [(0, 3), (1, 1), (2, 0)]
    alone = sums[2, 0].means((2, 0), frames=10)
    assert alone[:7] == (2, 0, 0.4, 0.2, 0.2, 0.1, 0.0)
    assert alone.track_trust_brier == pytest.approx((0.2**2 + 0.6**2 + 0.4**2) / 3)
    assert alone.track_auroc == 0.75  # above 0.2, equal to 0.6
    seen = sums[0, 3].means((0, 3), frames=10)
    assert (seen.damage_per_frame, seen.missing_targets_per_frame, seen.track_trust_brier) == (0.2, 0.2, 0.0)
    assert np.isnan(seen.track_auroc)
    only_missing = sums[1, 1].means((1, 1), frames=10)
    assert only_missing[2:7] == (0.0, 0.1, 0.0, 0.0, 0.1)
    assert np.isnan(only_missing.track_trust_brier)


def test_batches_add_up_in_any_order():
    rng = np.random.default_rng(0)
    rows = [(*rng.integers(0, 3, 2), rng.random(), *rng.integers(0, 2, 3)) for _ in range(60)]
    missing = rng.integers(0, 3, (20, 2))
    whole = sum_strata(tracks(*rows), pack(missing))
    parts = [sum_strata(tracks(*rows[:25]), pack(missing[:3])), sum_strata(tracks(*rows[25:]), pack(missing[3:]))]
    for order in (parts, parts[::-1]):
        merged = merge_strata(order)
        assert list(merged) == list(whole)
        for watchers, sums in whole.items():
            expected = sums.means(watchers, 7)
            assert merged[watchers].means(watchers, 7) == pytest.approx(expected, abs=1e-12, nan_ok=True)


def test_every_number_of_agents_can_be_told_from_a_stratum():
    watchers = np.array(list(itertools.product((0, 1, 255, 256), (0, 1, 255, 256))))
    assert [unpack(int(stratum)) for stratum in pack(watchers)] == [tuple(pair) for pair in watchers.tolist()]


def test_strata_of_episodes_equal_plain_loops():
    """By copies of the worlds' arrays; before its first edit in frame 6 the adversaries count as benign."""
    venv = trust_env.vector_env("patrol", "trust", num_worlds=3, max_cycles=15, autoreset=False)
    player, metrics = Player(venv, {"adversary": "sleeper(start=5, inner=false_positive)"}), EpisodeMetrics(venv)
    adversary = venv.worlds.roles > 0
    expected: dict[tuple[int, int], list[float]] = {}
    observations, _ = venv.reset(seed=4)
    for frame in range(1, 16):
        observations, *_, info = venv.step(player.actions(observations))
        metrics.update(info)
        a = venv.arrays
        for w in range(3):
            attacks = adversary & (frame >= 6)
            for j in np.flatnonzero(a.scored_confirmed[w]):
                counts = expected.setdefault(_watchers(a.expected[w, :, j], attacks), [0, 0, 0, 0])
                counts[0] += 1
                counts[1] += a.published[w, j] and a.track_target[w, j] < 0
                counts[2] += a.published[w, j] and a.track_target[w, j] < 0 and a.track_injected[w, j]
            held = _held(venv, w)
            found = set(a.track_target[w][a.published[w]].tolist())
            for n in np.flatnonzero(a.scored_visible[w]):
                if n not in found:
                    expected.setdefault(_watchers(held[n], attacks), [0, 0, 0, 0])[3] += 1
    sums = metrics.strata()
    counted = {key: [s.confirmed, s.false, s.injected, s.missing] for key, s in sums.items()}
    assert counted == {key: [int(value) for value in counts] for key, counts in expected.items()}
    assert any(k_a > 0 for k_a, _ in counted) and sum(counts[3] for counts in counted.values()) > 0


def _watchers(watches, attacks):
    return int((watches & attacks).sum()), int((watches & ~attacks).sum())


def _held(venv, w):
    """bool[N, K]: whose FOV holds the target; those of `patrol` are circles."""
    a = venv.arrays
    offset = a.scored_state[w][:, None, :2] - a.pose[w][None, :, :2]
    return np.linalg.norm(offset, axis=-1) <= venv.worlds.parameters["fov_radius"]


def test_strata_add_up_to_the_metrics():
    venv = trust_env.vector_env("trio", "majority", num_worlds=4, max_cycles=30, autoreset=False)
    player, metrics = Player(venv, {"adversary": "optimal_false_positive"}), EpisodeMetrics(venv)
    observations, _ = venv.reset(seed=0)
    for _ in range(30):
        observations, *_, info = venv.step(player.actions(observations))
        metrics.update(info)
    found, means = metrics.result(), [s.means(key, 4 * 30) for key, s in metrics.strata().items()]
    for part in ("damage", "false_tracks", "injected_tracks", "missing_targets"):
        name = f"{part}_per_frame"
        assert sum(getattr(stratum, name) for stratum in means) == pytest.approx(found[name].mean())
