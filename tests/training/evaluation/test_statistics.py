"""Interquartile means, their intervals, and paired differences."""

import numpy as np
import pytest
from scipy import stats

from trust_env.training.evaluation.statistics import (
    Interval,
    interquartile_mean,
    interval,
    mean_intervals,
    paired_difference,
    paired_mean_difference,
    placed_between,
    simultaneous,
)

NAN = float("nan")


def test_interquartile_mean_by_hand():
    """The lowest two and the highest two of eight are left out: the mean of 3, 4, 5, 6."""
    assert interquartile_mean(np.array([8, 1, 5, 3, 2, 7, 4, 6])) == 4.5
    assert interquartile_mean(np.array([0.0, 1.0, 2.0, 1000.0])) == 1.5


@pytest.mark.parametrize("n", [1, 2, 3, 5, 49, 50, 51])
def test_interquartile_mean_is_scipys_trimmed_mean(n):
    values = np.random.default_rng(n).normal(size=n)
    assert interquartile_mean(values) == stats.trim_mean(values, 0.25)
    middle = np.sort(values)[n // 4 : n - n // 4]
    assert interquartile_mean(values) == pytest.approx(middle.mean(), abs=1e-12)


def test_interval_is_scipys_percentile_bootstrap():
    values = np.sort(np.random.default_rng(1).exponential(size=50))
    found = interval(values, seed=7)
    assert found is not None
    expected = stats.bootstrap(
        (values,),
        lambda v, axis: stats.trim_mean(v, 0.25, axis=axis),
        method="percentile",
        rng=np.random.default_rng(7),
    ).confidence_interval
    assert found.iqm == stats.trim_mean(values, 0.25)
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high), abs=1e-12)
    assert found.low < found.iqm < found.high
    assert interval(values, seed=7) == found
    shuffled = np.random.default_rng(2).permutation(values)
    assert interval(shuffled, seed=7) == pytest.approx(found, abs=1e-12)


def test_intervals_cover_the_mean_in_95_of_100_samples():
    """Of 100 normal samples of 50 about 95 % have 0 within their interval; the binomial allows 88 to 100."""
    rng = np.random.default_rng(3)
    found = [interval(rng.normal(size=50)) for _ in range(100)]
    covered = sum(i.low <= 0.0 <= i.high for i in found if i is not None)
    assert 88 <= covered <= 100


def test_undefined_episodes_are_ignored():
    values = np.array([1.0, NAN, 2.0, 3.0, NAN, 4.0])
    assert interval(values) == interval(np.array([1.0, 2.0, 3.0, 4.0]))
    assert interval(np.array([NAN, NAN])) is None
    assert interval(np.array([])) is None
    assert interval(np.array([NAN, 2.5])) == Interval(2.5, 2.5, 2.5)
    assert interval(np.full(50, 201.0)) == Interval(201.0, 201.0, 201.0)


def test_paired_difference_cancels_variation_that_pairs_share():
    """Worlds differ by far more than the cells do: paired the difference is plain, unpaired it drowns."""
    rng = np.random.default_rng(0)
    worlds, noise = rng.normal(0.0, 100.0, 50), rng.normal(0.0, 0.1, 50)
    found = paired_difference(worlds + 1.0 + noise, worlds)
    assert found is not None
    assert found.iqm == stats.trim_mean(worlds + 1.0 + noise, 0.25) - stats.trim_mean(worlds, 0.25)
    assert 0.8 < found.low < 1.0 < found.high < 1.2
    alone = interval(worlds)
    assert alone is not None
    assert alone.high - alone.low > 20.0


def test_paired_difference_of_a_constant_shift_has_no_width():
    values = np.random.default_rng(0).normal(size=20)
    found = paired_difference(values + 0.5, values)
    assert found is not None
    assert found == pytest.approx((0.5, 0.5, 0.5), abs=1e-12)
    back = paired_difference(values, values + 0.5)
    assert back == pytest.approx((-0.5, -0.5, -0.5), abs=1e-12)


def test_paired_difference_uses_the_episodes_that_both_define():
    a, b = np.array([1.0, NAN, 3.0, 8.0]), np.array([0.5, 7.0, NAN, 7.5])
    assert paired_difference(a, b) == pytest.approx((0.5, 0.5, 0.5))
    assert paired_difference(np.array([NAN, 1.0]), np.array([1.0, NAN])) is None


@pytest.mark.parametrize("n", [2, 7, 50, 51])
def test_intervals_of_several_metrics_are_those_of_each_alone(n):
    rng = np.random.default_rng(n)
    metrics = {"a": rng.normal(size=n), "b": rng.exponential(size=n), "c": np.append(rng.normal(size=n - 1), NAN)}
    found = mean_intervals(metrics, seed=3)
    assert list(found) == ["a", "b", "c"]
    for name, values in metrics.items():
        known = np.sort(values[~np.isnan(values)])
        mean, iqm = found[name]
        if len(known) == 1:
            assert (mean, iqm) == ((known[0],) * 3, (known[0],) * 3)
            continue
        for bounds, statistic in ((mean, np.mean), (iqm, interquartile_mean)):
            theirs = stats.bootstrap((known,), statistic, method="percentile", rng=np.random.default_rng(3))
            expected = (statistic(known), theirs.confidence_interval.low, theirs.confidence_interval.high)
            assert bounds == pytest.approx(expected, abs=1e-12)


def test_intervals_do_not_depend_on_how_many_resamples_are_in_memory(monkeypatch):
    values = {"a": np.random.default_rng(0).normal(size=30)}
    whole = mean_intervals(values)["a"]
    monkeypatch.setattr("trust_env.training.evaluation.statistics.BATCH_NUMBERS", 3000)
    for found, expected in zip(mean_intervals(values)["a"], whole):
        assert found == pytest.approx(expected, abs=1e-12)


def test_paired_mean_difference_is_the_mean_of_the_differences():
    rng = np.random.default_rng(0)
    worlds, noise = rng.normal(0.0, 100.0, 50), rng.normal(0.0, 0.1, 50)
    found = paired_mean_difference(worlds + 1.0 + noise, worlds)
    assert found is not None
    assert found.value == pytest.approx(1.0 + noise.mean())
    assert 0.9 < found.low < found.value < found.high < 1.1
    assert paired_mean_difference(np.array([NAN, 1.0]), np.array([1.0, NAN])) is None


def test_place_between_two_others_by_hand():
    """Means 1 and 5: 2 lies at a quarter, 1 at 0, 5 at 1, 0 at -1/4."""
    low, high = np.array([0.0, 1.0, 2.0]), np.array([4.0, 5.0, 6.0])
    for shift, place in ((1.0, 0.25), (0.0, 0.0), (4.0, 1.0), (-1.0, -0.25)):
        found = placed_between(low + shift, low, high)
        assert found is not None
        assert found == pytest.approx((place, place, place), abs=1e-12)  # constant shifts, drawn by pairs
    assert placed_between(low, high, low) is None
    assert placed_between(low, low, low) is None
    assert placed_between(np.full(3, NAN), low, high) is None
    wide = placed_between(low + 1.0, low, np.array([9.0, 0.0, 0.0]))  # in some resamples not above
    assert wide is not None and wide.value == pytest.approx(0.5) and np.isnan([wide.low, wide.high]).all()


def test_simultaneous_intervals_cover_all_rows_at_once_in_95_of_100_samples():
    """Twenty dependent rows; single 95 % intervals would cover all of them far less often."""
    rng, together, alone = np.random.default_rng(5), 0, 0
    for _ in range(100):
        rows = rng.normal(size=(20, 60)) + rng.normal(size=60)
        together += all(i.low <= 0.0 <= i.high for i in simultaneous(rows))
        each = mean_intervals({str(i): row for i, row in enumerate(rows)}).values()
        alone += all(mean.low <= 0.0 <= mean.high for mean, _ in each)
    assert 86 <= together <= 100
    assert alone < together - 10


def test_simultaneous_intervals_of_copies_of_a_row_are_those_of_one():
    row = np.random.default_rng(0).normal(size=40)
    (one,) = simultaneous([row])
    for found in simultaneous([row, row, row + 3.0]):
        assert found.high - found.low == pytest.approx(one.high - one.low, rel=0.02)
    assert one.value == row.mean()
    assert one.high - one.value == pytest.approx(one.value - one.low)
    (middle,) = simultaneous([row], "iqm")
    assert middle.value == stats.trim_mean(row, 0.25)
    assert simultaneous([np.full(5, 2.0)]) == [(2.0, 2.0, 2.0)]


@pytest.mark.parametrize("rows", [[], [np.zeros(3), np.zeros(4)], [np.empty(0)], [np.array([1.0, NAN])]])
def test_simultaneous_intervals_need_rows_of_the_same_defined_episodes(rows):
    with pytest.raises(ValueError, match="rows must"):
        simultaneous(rows)
