"""The track-score theory against the published tables, numbers worked out by hand and closed forms."""

import itertools
import json
import math

import numpy as np
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


def test_theorem_1_gives_the_published_figure_with_its_own_parameters():
    assert round(theory.frames_to_confirm(1, 1, eta=3), 2) == 3.07
    assert round(theory.frames_to_confirm(1, 3, eta=3), 2) == 6.00


def test_scores_worked_out_by_hand():
    assert theory.initial_score() == pytest.approx(-7.0131158)  # ln(0.9e-3)
    assert theory.score_thresholds() == pytest.approx((-4.6050702, 9.2002900))  # ln(0.01 / 0.9999), ln(9900)
    assert theory.score_thresholds().confirm == pytest.approx(9.2002900)
    assert theory.max_hit_gain() == pytest.approx(
        11.0675535, abs=1e-6
    )  # ln(0.9e6 / (2π sqrt 5)) = ln 64058.6
    assert theory.max_hit_gain(eta=3) == pytest.approx(11.0675535 - 0.9189385, abs=1e-6)  # less ln sqrt(2π)
    assert theory.max_score_change(1, 3) == pytest.approx(11.0675535 - 3 * 2.3025851, abs=1e-6)
    assert theory.max_score_change(0, 2) == pytest.approx(-4.6051702)


def test_gate_volume_by_hand():
    # Planar: π G sqrt(det S), G = -2 ln(1 - 0.99) = 9.2103404.
    assert theory.gate_volume(0.99, math.sqrt(5.0) * np.eye(2)) == pytest.approx(64.70093, abs=1e-4)
    assert theory.gate_volume(0.99, np.diag([2.0, 8.0])) == pytest.approx(math.pi * 9.2103404 * 4.0)
    assert theory.gate_volume(9.2103404, np.diag([2.0, 8.0])) == pytest.approx(math.pi * 9.2103404 * 4.0)
    # Space: 4/3 π G^1.5; the 0.99 quantile of χ² with 3 degrees of freedom is 11.3448667.
    assert theory.gate_volume(0.99, np.eye(3)) == pytest.approx(4.0 / 3.0 * math.pi * 11.3448667**1.5)
    # A line: 2 sqrt(G); its 0.99 quantile is 2.5758293².
    assert theory.gate_volume(0.99, np.array([[4.0]])) == pytest.approx(2.0 * 2.5758293 * 2.0)


def test_gate_false_positives_of_proposition_3():
    probability = theory.gate_false_positive_probability
    assert probability(0.0, 1e-6) == 0.0
    assert probability(math.log(2.0) / 1e-6, 1e-6) == pytest.approx(0.5)
    # "One in 100 s at 10 Hz" is one in 1000 frames: it takes a gate of 1000 volume units, ...
    assert 0.1 / probability(1000.0, 1e-6) == pytest.approx(100.05, abs=1e-3)
    # ... whereas the planar gate of the paper's other numbers is 15 times smaller: one in 1546 s.
    volume = theory.gate_volume(0.99, math.sqrt(5.0) * np.eye(2))
    assert 0.1 / probability(volume, 1e-6) == pytest.approx(1545.6, abs=0.1)


def test_sequential_bound():
    for n_benign in range(7):
        assert theory.sequential_frames_to_confirm(1, n_benign) == theory.frames_to_confirm(1, n_benign)
    # K_a = 2: 1 + (16.2134058 - 11.0675535) / (22.1351070 - 2.3025851 K_b)
    assert theory.sequential_frames_to_confirm(2, 0) == pytest.approx(1.2324746, abs=1e-6)
    assert theory.sequential_frames_to_confirm(2, 8) == pytest.approx(2.3853688, abs=1e-6)
    assert theory.sequential_frames_to_confirm(2, 10) == INF
    # Three hits in one frame confirm whatever comes later.
    assert theory.sequential_frames_to_confirm(3, 0) == theory.sequential_frames_to_confirm(3, 40) == 1.0
    assert theory.frames_to_confirm(0, 0) == theory.sequential_frames_to_confirm(0, 0) == INF


ORIENTATION = {  # (K_a, K_b): (adversaries first, adversaries last)
    **{
        (1, k): pair
        for k, pair in enumerate([(3, 3), (4, 3), (5, 4), (8, 6), (17, 12), (INF, INF), (INF, INF)])
    },
    **{(2, k): pair for k, pair in enumerate([(2, 2), (2, 2), (2, 2), (2, 2), (3, 2), (3, 2), (4, 2)])},
}


@pytest.mark.parametrize("dt", [0.1, 1.0])
@pytest.mark.parametrize(("team", "frames"), ORIENTATION.items())
def test_score_optimal_frames_in_both_orders(team, frames, dt):
    n_adversaries, n_benign = team
    first, last = "A" * n_adversaries + "B" * n_benign, "B" * n_benign + "A" * n_adversaries
    assert theory.score_optimal_frames(first, dt=dt) == frames[0]
    assert theory.score_optimal_frames(last, dt=dt) == frames[1]


def frames_of_a_resting_track(order: str, p_detect: float) -> float:
    """Closed form without motion: the n-th hit has S = R n / (n - 1), so n hits give (n - 1) g - ln n."""
    gain, miss = theory.max_hit_gain(p_detect=p_detect), math.log(1.0 - p_detect)
    late = order[order.index("A") :]
    peak = -INF
    for frame in range(1, 20_000):
        hits = order.count("A") * (frame - 1) + late.count("A")
        misses = order.count("B") * (frame - 1) + late.count("B")
        score = math.log(p_detect * 1e-3) + (hits - 1) * gain - math.log(hits) + misses * miss
        peak = max(peak, score)
        if score >= math.log(9900.0):
            return frame
        if score < peak - 4.5:
            return INF
    raise AssertionError("undecided")


@pytest.mark.parametrize("p_detect", [0.6, 0.9, 0.99])
def test_score_optimal_frames_of_a_resting_track_in_closed_form(p_detect):
    orders = [order for n in range(1, 6) for order in map("".join, itertools.product("AB", repeat=n))]
    for order in (order for order in orders if "A" in order):
        frames = theory.score_optimal_frames(
            order, p_detect=p_detect, initial_velocity_variance=0.0, process_noise=0.0
        )
        assert frames == frames_of_a_resting_track(order, p_detect), order


@pytest.mark.parametrize("order", ["A", "AB", "BBA", "ABBB", "BABBB", "AAB", "AABBBBBBB", "BABABBBB"])
def test_no_score_optimal_attack_beats_the_sequential_bound(order):
    bound = theory.sequential_frames_to_confirm(order.count("A"), order.count("B"))
    assert theory.score_optimal_frames(order) >= math.ceil(bound)


def frames_by_one_axis(order: str, p_detect: float, process_noise: float, dt: float, limit: int) -> float:
    """The recursion again, with one axis in plain floats: S = s I, so sqrt(det S) = s."""
    pp, pv, vv, r, q = math.sqrt(5.0), 0.0, 1e-4, math.sqrt(5.0), process_noise
    score = math.log(p_detect * 1e-3) + order[1:].count("B") * math.log(1.0 - p_detect)
    for frame in range(2, limit):
        pp, pv, vv = pp + 2 * dt * pv + dt**2 * vv + q * dt**3 / 3, pv + dt * vv + q * dt**2 / 2, vv + q * dt
        s = pp + r
        pp, pv, vv = pp - pp**2 / s, pv - pp * pv / s, vv - pv**2 / s
        score += math.log(p_detect * 1e6 / (2 * math.pi * s)) + order.count("B") * math.log(1.0 - p_detect)
        if score >= math.log(9900.0):
            return frame
    return INF


@pytest.mark.parametrize("p_detect", [0.9, 0.925, 0.93, 0.931, 0.932])
def test_score_optimal_frames_once_the_filter_is_steady(p_detect):
    frames = theory.score_optimal_frames("ABBBB", p_detect=p_detect, process_noise=1e-2, dt=1.0)
    assert frames == frames_by_one_axis("ABBBB", p_detect, 1e-2, 1.0, limit=200_000)


def test_score_optimal_frames_ends_without_a_deletion_rule():
    # Prop. 2 allows a gain of 1.857 nats a frame, but the steady filter's S takes more than that away.
    assert theory.max_score_change(1, 4) > 1.8
    wild = {"process_noise": 1e4, "dt": 1.0, "tentative_drop": INF}
    assert theory.score_optimal_frames("ABBBB", **wild) == INF
    assert theory.score_optimal_frames("ABBBBB", tentative_drop=INF) == INF


def test_score_optimal_frames_reads_every_form_of_an_order():
    assert theory.score_optimal_frames(["adversary", "benign"]) == theory.score_optimal_frames("AB") == 4
    assert theory.score_optimal_frames("BBB") == theory.score_optimal_frames("") == INF


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: theory.frames_to_confirm(1, 1, p_detect=1.0), "p_detect = 1.0: expected a probability"),
        (lambda: theory.frames_to_confirm(-1, 1), "n_adversaries = -1: expected a count"),
        (lambda: theory.initial_score(beta_fp=0.0), "beta_fp = 0.0: expected a positive number"),
        (lambda: theory.score_thresholds(alpha=0.0), "alpha = 0.0: expected a probability"),
        (lambda: theory.score_optimal_frames("AX"), "order = 'X': expected"),
        (lambda: theory.score_optimal_frames("A", noise_cov=-np.eye(2)), "noise_cov .*positive definite"),
        (lambda: theory.score_optimal_frames("A", noise_cov=np.eye(3)), "noise_cov .*a 2x2 matrix"),
        (lambda: theory.gate_volume(0.0, np.eye(2)), "gate = 0.0: expected"),
    ],
)
def test_errors_name_the_value_and_what_was_expected(call, message):
    with pytest.raises(ValueError, match=message):
        call()
