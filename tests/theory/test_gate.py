"""Volumes of gates and natural false positives in them, against numbers worked out by hand."""

import math

import numpy as np
import pytest

from trust_env import theory


def test_gate_volume_equals_values_worked_out_by_hand_in_one_to_three_dimensions():
    # Planar: π G sqrt(det S), G = -2 ln(1 - 0.99) = 9.2103404.
    assert theory.gate_volume(0.99, math.sqrt(5.0) * np.eye(2)) == pytest.approx(64.70093, abs=1e-4)
    assert theory.gate_volume(0.99, np.diag([2.0, 8.0])) == pytest.approx(math.pi * 9.2103404 * 4.0)
    assert theory.gate_volume(9.2103404, np.diag([2.0, 8.0])) == pytest.approx(math.pi * 9.2103404 * 4.0)
    # Space: 4/3 π G^1.5; the 0.99 quantile of χ² with 3 degrees of freedom is 11.3448667.
    assert theory.gate_volume(0.99, np.eye(3)) == pytest.approx(4.0 / 3.0 * math.pi * 11.3448667**1.5)
    # A line: 2 sqrt(G); its 0.99 quantile is 2.5758293².
    assert theory.gate_volume(0.99, np.array([[4.0]])) == pytest.approx(2.0 * 2.5758293 * 2.0)


def test_gate_false_positives_are_as_rare_as_proposition_3_says():
    probability = theory.gate_false_positive_probability
    assert probability(0.0, 1e-6) == 0.0
    assert probability(math.log(2.0) / 1e-6, 1e-6) == pytest.approx(0.5)
    # "One in 100 s at 10 Hz" is one in 1000 frames: it takes a gate of 1000 volume units, ...
    assert 0.1 / probability(1000.0, 1e-6) == pytest.approx(100.05, abs=1e-3)
    # ... whereas the planar gate of the paper's other numbers is 15 times smaller: one in 1546 s.
    volume = theory.gate_volume(0.99, math.sqrt(5.0) * np.eye(2))
    assert 0.1 / probability(volume, 1e-6) == pytest.approx(1545.6, abs=0.1)
