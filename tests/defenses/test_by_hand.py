"""First frames of the built-in defenses on evidence so small that every number can be worked out by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import trust_env
from trust_env.fusion_centre import ReplayedFrame

pytestmark = [pytest.mark.core, pytest.mark.nojit]


def judged(defense: str, *frames: Sequence[int], expected: Sequence[int] | None = None) -> list[ReplayedFrame]:
    """The verdicts on one track that every agent expects (or as given), and that those hit that have a 1."""
    listed: list[dict[str, Any]] = []
    for hits in frames:
        hit = np.array(hits, dtype=bool)[:, None]
        look = np.ones_like(hit) if expected is None else np.array(expected, dtype=bool)[:, None]
        listed.append({"track_id": [3], "expected": look, "detected": hit, "held": hit})
    return trust_env.replay_evidence(listed, len(frames[0]), defense)


def test_quorum_shows_what_two_have_hit_and_hides_what_two_keep_missing():
    frames = [(1, 0, 0), (1, 0, 0), (0, 1, 0), *[(1, 0, 0)] * 5]
    verdicts = judged("quorum(misses=4)", *frames)
    shown = [bool(verdict.publish[0]) for verdict in verdicts]
    # agent 2 misses from the first frame on, agent 1 from the fourth: both four times in a row from the seventh
    assert shown == [False, False, True, True, True, True, False, False]
    assert np.isnan(verdicts[2].track_trust).all() and np.isnan(verdicts[2].agent_trust).all()


def test_quorum_forgets_hits_beyond_its_window():
    frames = [(1, 0), (0, 0), (0, 1)]
    assert [bool(v.publish[0]) for v in judged("quorum(window=3)", *frames)] == [False, False, True]
    assert [bool(v.publish[0]) for v in judged("quorum(window=2)", *frames)] == [False, False, False]


@pytest.mark.parametrize(("strict", "shown"), [("True", False), ("False", True)])
def test_quorum_and_a_track_that_one_agent_watches(strict, shown):
    verdicts = judged(f"quorum(strict={strict})", *[(1, 0)] * 6, expected=(1, 0))
    assert [bool(verdict.publish[0]) for verdict in verdicts] == [shown] * 6


def test_binary_beta_counts_agreement_with_the_majority():
    first, last = judged("binary_beta(window=2)", (1, 1, 0, 0, 1), (0, 0, 0, 0, 1))
    assert first.agent_trust == pytest.approx([2 / 3, 2 / 3, 1 / 3, 1 / 3, 2 / 3])
    assert first.agent_trust_var == pytest.approx([1 / 18] * 5)  # Beta(2, 1)
    assert first.track_trust == pytest.approx([0.6])
    assert last.agent_trust == pytest.approx([3 / 4, 3 / 4, 1 / 2, 1 / 2, 1 / 2])
    assert last.track_trust == pytest.approx([0.6 + (0.2 - 0.6) / 2]) and last.publish.tolist() == [False]


@pytest.mark.parametrize("defense", ["binary_beta", "rfsn_beta", "particle(sigma=0)", "cusum"])
def test_ties_and_lone_looks_say_nothing_of_agents(defense):
    fresh = judged(defense, (1, 1), expected=(1, 1))[0].agent_trust
    for verdict in judged(defense, *[(1, 0)] * 3, expected=(1, 0)):
        assert verdict.agent_trust[1] == pytest.approx(1.0 if defense == "cusum" else 0.5)
        assert verdict.agent_trust[0] == verdict.agent_trust[1] <= fresh[0]
        assert np.isnan(verdict.track_trust).all() and verdict.publish.tolist() == [True]
    if defense == "binary_beta":
        assert judged(defense, (1, 0))[0].agent_trust == pytest.approx([0.5, 0.5])


def test_rfsn_beta_weighs_the_others_by_their_trust():
    first, second = judged("rfsn_beta", (1, 1, 0), (1, 1, 0))
    # the others of agents 0 and 1 are even at first; those of agent 2 are against it
    assert first.agent_trust == pytest.approx([1 / 2, 1 / 2, 1 / 3])
    assert first.track_trust == pytest.approx([(0.5 + 0.5) / (0.5 + 0.5 + 1 / 3)])
    assert second.agent_trust == pytest.approx([2 / 3, 2 / 3, 1 / (2 + 0.98 + 1)])
    share = (4 / 3) / (4 / 3 + 1 / 3.98)
    assert second.track_trust == pytest.approx([0.75 + (share - 0.75) / 10])


def test_score_asymmetry_hides_what_one_watcher_does_not_hit():
    verdicts = judged("score_asymmetry", *[(1, 0)] * 5)
    # .1^3 is not below .001 / 4, .1^4 is; from three looks on
    assert [bool(verdict.publish[0]) for verdict in verdicts] == [True, True, True, False, False]
    assert all(verdict.publish[0] for verdict in judged("score_asymmetry(l=1)", *[(1, 0)] * 9))


def test_dawid_skene_begins_with_its_priors():
    (verdict,) = judged("dawid_skene", (1, 0))
    odds = 4.0 * (0.9 / 0.05) * (0.1 / 0.95)
    z = odds / (1 + odds)
    assert verdict.track_trust == pytest.approx([z])
    hit = (9 + z) / (10 + z) - (0.5 + 1 - z) / (10 + 1 - z)
    miss = 9 / (10 + z) - 0.5 / (10 + 1 - z)
    assert verdict.agent_trust == pytest.approx([hit, miss])


def test_path_trust_passes_on_what_was_seen_together():
    (verdict,) = judged("path_trust(anchor=0)", (1, 1, 0))
    # (t, c) are (2/3, 1/21) with agent 1 and (1/3, 1/21) with agent 2
    assert verdict.agent_trust == pytest.approx([1.0, 2 / 3, 1 / 3])
    assert verdict.track_trust == pytest.approx([(1 + 2 / 63) / (1 + 2 / 63 + 1 / 63)])
    lone = judged("path_trust(anchor=0)", (1, 1, 0), expected=(1, 1, 0))[0]
    assert lone.agent_trust == pytest.approx([1.0, 2 / 3, math.nan], nan_ok=True)


def test_path_trust_takes_the_longer_path_where_it_is_better_known():
    frames = []
    for looks in [(1, 1, 0)] * 40 + [(0, 1, 1)] * 40 + [(1, 0, 1)]:
        hit = np.array(looks, dtype=bool)[:, None]
        frames.append({"track_id": [3], "expected": hit, "detected": hit, "held": hit})
    last = trust_env.replay_evidence(frames, 3, "path_trust(anchor=0, ageing=1)")[-1]
    # directly c = 1/21 and t = 2/3; by way of agent 1 c = (40/60)² and t = (41/42)²
    assert last.agent_trust == pytest.approx([1.0, 41 / 42, (41 / 42) ** 2])


def test_cusum_rises_with_misses_of_what_two_others_hit():
    verdicts = judged("cusum", (1, 1, 0), (1, 1, 0), (1, 1, 1), (1, 0, 0), *[(1, 1, 0)] * 9)
    miss, hit = math.log(0.55 / 0.1), math.log(0.5)
    g = [miss, 2 * miss, 2 * miss + hit, 2 * miss + hit, 3 * miss + hit]
    for verdict, expected in zip(verdicts, g):
        assert verdict.agent_trust == pytest.approx([1.0, 1.0, 1 - expected / 14])
    assert verdicts[-1].agent_trust.tolist() == [1.0, 1.0, 0.0]
    assert verdicts[-1].track_trust[0] > verdicts[3].track_trust[0]
