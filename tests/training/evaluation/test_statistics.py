"""Interquartile means, their intervals, and paired differences."""

import numpy as np
import pytest
from scipy import stats

from trust_env.training.evaluation.statistics import Interval, interquartile_mean, interval, paired_difference

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
    values = np.random.default_rng(1).exponential(size=50)
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
