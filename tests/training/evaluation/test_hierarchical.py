"""Mean and worst decile over runs and episodes, and intervals that count the chance of both."""

import numpy as np
import pytest
from scipy import stats

from trust_env.training.evaluation.hierarchical import outcome
from trust_env.training.evaluation.statistics import mean_intervals


def test_mean_and_worst_decile_by_hand():
    """Of 1 to 40 in two runs the worst tenth are 37, 38, 39, 40; of twelve values it is two."""
    found = outcome(np.random.default_rng(0).permutation(np.arange(1.0, 41.0)).reshape(2, 20))
    assert (found.mean.value, found.worst_decile.value) == (20.5, 38.5)
    assert outcome(np.arange(12.0)).worst_decile.value == 10.5
    assert outcome(np.full((3, 4), 2.5)) == ((2.5, 2.5, 2.5), (2.5, 2.5, 2.5))


def test_one_run_has_the_interval_of_its_episodes():
    values = np.random.default_rng(1).exponential(size=80)
    found, expected = outcome(values), mean_intervals({"": values})[""][0]
    assert found.mean == pytest.approx(expected, rel=0.02)
    worst = stats.bootstrap((values,), lambda v, axis: np.sort(v, axis=axis)[..., -8:].mean(axis=axis),
                            method="percentile", rng=np.random.default_rng(2)).confidence_interval  # fmt: skip
    assert found.worst_decile[1:] == pytest.approx((worst.low, worst.high), rel=0.03)


def test_runs_that_differ_widen_the_interval_however_many_episodes_there_are():
    """Three runs of means 1, 2 and 3: with chance 1/27 a resample holds the lowest one only."""
    rng = np.random.default_rng(3)
    found = outcome(np.array([[1.0], [2.0], [3.0]]) + rng.normal(0.0, 0.01, (3, 500)))
    assert found.mean == pytest.approx((2.0, 1.0, 3.0), abs=0.02)
    alike = outcome(np.full((3, 1), 2.0) + rng.normal(0.0, 0.01, (3, 500)))
    assert alike.mean.high - alike.mean.low < 0.01


def test_what_the_episodes_share_does_not_average_out_over_runs():
    """Twenty runs of equal skill play the same 30 episodes: the interval is that of one run, not narrower."""
    episodes = np.random.default_rng(4).normal(size=30)
    one, many = outcome(episodes).mean, outcome(np.tile(episodes, (20, 1))).mean
    assert many.high - many.low == pytest.approx(one.high - one.low, rel=0.05)


def test_intervals_cover_the_truth_in_95_of_100_experiments():
    """Ten runs and 40 episodes drawn anew; percentile intervals of ten runs are a little too narrow."""
    rng, covered = np.random.default_rng(5), 0
    for _ in range(100):
        values = rng.normal(size=(10, 1)) + rng.normal(size=40) + rng.normal(size=(10, 40))
        covered += (found := outcome(values).mean).low <= 0.0 <= found.high
    assert 84 <= covered <= 100


def test_intervals_do_not_depend_on_how_many_resamples_are_in_memory(monkeypatch):
    values = np.random.default_rng(6).normal(size=(3, 20))
    whole = outcome(values)
    monkeypatch.setattr("trust_env.training.evaluation.statistics.BATCH_NUMBERS", 3000)
    for found, expected in zip(outcome(values), whole):
        assert found == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("values", [np.empty((2, 0)), np.array([1.0, np.nan]), np.zeros((2, 2, 2))])
def test_only_finite_values_of_runs_and_episodes_are_taken(values):
    with pytest.raises(ValueError, match="expected finite values"):
        outcome(values)
