"""Theorem 1 against the published tables, and the corrected bound against numbers worked out by hand."""

import json
import math

import pytest
from paths import REFERENCE

from trust_env import theory

FRAMES = json.loads((REFERENCE / "frames_to_confirm.json").read_text())
INF = math.inf


@pytest.mark.parametrize("table", FRAMES["tables"], ids=lambda t: f"eta={t['eta']},alpha={t['alpha']}")
def test_theorem_1_equals_every_published_table(table):
    for n_adversaries, row in enumerate(table["t_min"], start=1):
        for n_benign, published in enumerate(row):
            frames = theory.frames_to_confirm(
                n_adversaries, n_benign, eta=table["eta"], alpha=table["alpha"], **FRAMES["parameters"]
            )
            assert frames == pytest.approx(INF if published is None else published, abs=1e-6)


def test_theorem_1_equals_the_published_figure_with_the_parameters_it_was_drawn_with():
    assert round(theory.frames_to_confirm(1, 1, eta=3), 2) == 3.07
    assert round(theory.frames_to_confirm(1, 3, eta=3), 2) == 6.00


def test_sequential_bound_is_theorem_1_for_one_adversary_and_equals_hand_values_for_more():
    for n_benign in range(7):
        assert theory.sequential_frames_to_confirm(1, n_benign) == theory.frames_to_confirm(1, n_benign)
    # K_a = 2: 1 + (16.2134058 - 11.0675535) / (22.1351070 - 2.3025851 K_b)
    assert theory.sequential_frames_to_confirm(2, 0) == pytest.approx(1.2324746, abs=1e-6)
    assert theory.sequential_frames_to_confirm(2, 8) == pytest.approx(2.3853688, abs=1e-6)
    assert theory.sequential_frames_to_confirm(2, 10) == INF
    # Three hits in one frame confirm whatever comes later.
    assert theory.sequential_frames_to_confirm(3, 0) == theory.sequential_frames_to_confirm(3, 40) == 1.0
    assert theory.frames_to_confirm(0, 0) == theory.sequential_frames_to_confirm(0, 0) == INF


@pytest.mark.parametrize("order", ["A", "AB", "BBA", "ABBB", "BABBB", "AAB", "AABBBBBBB", "BABABBBB"])
def test_no_score_optimal_attack_beats_the_sequential_bound(order):
    bound = theory.sequential_frames_to_confirm(order.count("A"), order.count("B"))
    assert theory.score_optimal_frames(order) >= math.ceil(bound)
