"""The score recursion against known values, a closed form and a recursion along one axis."""

import itertools
import math

import pytest

from trust_env import theory

INF = math.inf

# By K_a, then by K_b = 0, 1, ...: (adversaries first, adversaries last) in the order of the agents.
KNOWN_FRAMES = {
    1: [(3, 3), (4, 3), (5, 4), (8, 6), (17, 12), (INF, INF), (INF, INF)],
    2: [(2, 2), (2, 2), (2, 2), (2, 2), (3, 2), (3, 2), (4, 2)],
}
TEAMS = [(n, k, frames) for n, row in KNOWN_FRAMES.items() for k, frames in enumerate(row)]


@pytest.mark.parametrize("dt", [0.1, 1.0])
@pytest.mark.parametrize(("n_adversaries", "n_benign", "frames"), TEAMS)
def test_score_optimal_frames_equal_known_values_in_both_orders(n_adversaries, n_benign, frames, dt):
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
def test_score_optimal_frames_of_a_resting_track_equal_the_closed_form(p_detect):
    orders = [order for n in range(1, 6) for order in map("".join, itertools.product("AB", repeat=n))]
    for order in (order for order in orders if "A" in order):
        frames = theory.score_optimal_frames(order, p_detect=p_detect, initial_velocity_variance=0.0, process_noise=0.0)
        assert frames == frames_of_a_resting_track(order, p_detect), order


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
def test_score_optimal_frames_of_a_steady_filter_equal_a_recursion_along_one_axis(p_detect):
    frames = theory.score_optimal_frames("ABBBB", p_detect=p_detect, process_noise=1e-2, dt=1.0)
    assert frames == frames_by_one_axis("ABBBB", p_detect, 1e-2, 1.0, limit=200_000)


def test_score_optimal_frames_are_infinite_without_a_deletion_rule_once_no_frame_adds_to_the_score():
    # Prop. 2 allows a gain of 1.857 nats a frame, but the steady filter's S takes more than that away.
    assert theory.max_score_change(1, 4) > 1.8
    wild = {"process_noise": 1e4, "dt": 1.0, "tentative_drop": INF}
    assert theory.score_optimal_frames("ABBBB", **wild) == INF
    assert theory.score_optimal_frames("ABBBBB", tentative_drop=INF) == INF


def test_an_order_may_be_names_or_a_text():
    assert theory.score_optimal_frames(["adversary", "benign"]) == theory.score_optimal_frames("AB") == 4


def test_without_an_adversary_nothing_is_confirmed():
    assert theory.score_optimal_frames("BBB") == theory.score_optimal_frames("") == INF
