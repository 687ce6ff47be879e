"""Pooled Brier scores and calibration: every forecast counts once."""

from __future__ import annotations

import numpy as np
import pytest

from trust_env.metrics.forecast_scores import Forecasts
from trust_env.training.evaluation.pooling import pool


def cell(track_forecasts):
    """Metrics and reliability of a cell, from forecasts and outcomes by episode; no opinions on agents."""
    n = len(track_forecasts)
    found = Forecasts(n)
    for episode, pairs in enumerate(track_forecasts):
        if pairs:
            trust, true = np.array(pairs, float).T
            found.add(np.full(len(pairs), episode), trust, true.astype(bool))
    metrics = {"track_trust_brier": found.brier(), "agent_trust_brier": np.full(n, np.nan)}
    return metrics, {"track_trust": found.bins, "agent_trust": np.zeros((n, 3, 10))}


def pooled(*cells):
    return pool([metrics for metrics, _ in cells], [reliability for _, reliability in cells])


def test_pooled_scores_by_hand():
    """Three episodes, one without forecasts: of 0.9, 0.9, 0.9 two came true, and 0.2 did."""
    found = pooled(cell([[(0.9, 1), (0.9, 1), (0.9, 0)], [], [(0.2, 1)]]))["track_trust"]
    assert found["forecasts"] == 4
    assert found["brier"] == pytest.approx((2 * 0.01 + 0.81 + 0.64) / 4)
    assert found["calibration_error"] == pytest.approx((abs(2.7 - 2) + abs(0.2 - 1)) / 4)
    assert found["count"] == [0, 0, 1, 0, 0, 0, 0, 0, 0, 3]
    assert found["mean_forecast"][2] == pytest.approx(0.2) and found["mean_forecast"][0] is None
    assert found["share_true"][9] == pytest.approx(2 / 3) and found["share_true"][3] is None


def test_errors_of_opposite_sign_cancel_in_the_pool_and_not_in_the_mean_over_episodes():
    """0.5 forecasts what comes true in one episode and does not in the other: calibrated as a whole."""
    metrics, reliability = cell([[(0.5, 1)] * 4, [(0.5, 0)] * 4])
    assert pooled((metrics, reliability))["track_trust"]["calibration_error"] == pytest.approx(0.0)
    assert metrics["track_trust_brier"].tolist() == [0.25, 0.25]


def test_a_pool_of_cells_is_that_of_all_their_episodes():
    rng = np.random.default_rng(0)
    episodes = [[(rng.random(), rng.integers(0, 2)) for _ in range(rng.integers(0, 9))] for _ in range(10)]
    together, apart = pooled(cell(episodes)), pooled(cell(episodes[:4]), cell(episodes[4:]))
    for name, value in together["track_trust"].items():
        other = apart["track_trust"][name]
        if isinstance(value, list):
            assert [v is None for v in value] == [v is None for v in other]
            value, other = ([v or 0.0 for v in values] for values in (value, other))
        assert other == pytest.approx(value, abs=1e-12)


def test_without_a_forecast_there_is_no_score():
    assert "agent_trust" not in pooled(cell([[(0.5, 1)]]))
    assert pooled(cell([[], []])) == {}
