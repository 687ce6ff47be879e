"""The track score against numbers worked out by hand."""

import pytest

from trust_env import theory


def test_scores_gains_and_thresholds_equal_values_worked_out_by_hand():
    assert theory.initial_score() == pytest.approx(-7.0131158)  # ln(0.9e-3)
    assert theory.score_thresholds() == pytest.approx((-4.6050702, 9.2002900))  # ln(0.01 / 0.9999), ln(9900)
    assert theory.score_thresholds().confirm == pytest.approx(9.2002900)
    # ln(0.9e6 / (2π sqrt 5)) = ln 64058.6
    assert theory.max_hit_gain() == pytest.approx(11.0675535, abs=1e-6)
    assert theory.max_hit_gain(eta=3) == pytest.approx(11.0675535 - 0.9189385, abs=1e-6)  # less ln sqrt(2π)
    assert theory.max_score_change(1, 3) == pytest.approx(11.0675535 - 3 * 2.3025851, abs=1e-6)
    assert theory.max_score_change(0, 2) == pytest.approx(-4.6051702)
