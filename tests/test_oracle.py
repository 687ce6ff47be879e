"""The reference itself: against the authors' published numbers, and against numbers worked out by hand."""

import itertools
import json
import math

import numpy as np
import pytest
from oracle import (
    Belief,
    OracleCentre,
    OracleEvidence,
    OracleTracker,
    OracleTrust,
    TrackerParams,
    assign,
    circle,
    oracle_evidence,
    polygon,
    sector,
)
from paths import REFERENCE

from trust_env import theory

CASES = json.loads((REFERENCE / "cdc2024_cases.json").read_text())["cases"]
PRIOR_MEAN = {"trusted": 0.8, "untrusted": 0.5, "distrusted": 0.2}
EVERYWHERE = circle((0.0, 0.0), 1e9)
NOWHERE = circle((1e9, 0.0), 1.0)
R5 = math.sqrt(5.0) * np.eye(2)


# --- Trust --------------------------------------------------------------------------------------------------


def evidence_of(frame: dict, n_agents: int) -> OracleEvidence:
    tracks = frame["tracks"]
    ids = [track["track"] for track in tracks]
    expected, detected, held = (np.zeros((n_agents, len(ids)), dtype=bool) for _ in range(3))
    for j, track in enumerate(tracks):
        for k, (value, _) in zip(track["in_fov_of"], track["psms"], strict=True):
            expected[k, j], detected[k, j] = True, value == 1.0
    for agent in frame["agents"]:
        for track, seen, _, _ in agent["candidate_psms"]:
            held[agent["agent"], ids.index(track)] = seen
    return OracleEvidence(np.array(ids, dtype=int), expected, detected, held)


def priors_of(case: dict) -> dict[int, tuple[float, float]]:
    return {int(k): (PRIOR_MEAN[p["type"]], p["strength"]) for k, p in case["prior_agents"].items()}


@pytest.mark.parametrize("name", CASES)
def test_cdc2024_gives_every_published_belief(name):
    case = CASES[name]
    n_agents = len(case["agent_positions"])
    trust = OracleTrust("cdc2024", n_agents=n_agents, agent_priors=priors_of(case))
    for frame in case["frames"]:
        trust.update(evidence_of(frame, n_agents))
        for track in frame["tracks"]:
            published = (track["alpha"], track["beta"])
            assert trust.track_beliefs[track["track"]] == pytest.approx(published, abs=1e-9)
        for agent in frame["agents"]:
            published = (agent["alpha"], agent["beta"])
            assert trust.agent_beliefs[agent["agent"]] == pytest.approx(published, abs=1e-9)
            used = [tuple(psm) for psm in agent["used_psms"]]
            assert trust.agent_psms[agent["agent"]] == [pytest.approx(psm, abs=1e-9) for psm in used]


def test_paper_preset_shows_case_1_otherwise_than_its_figure():
    case = CASES["case1_no_prior"]
    trust = OracleTrust("paper", n_agents=3)
    for frame in case["frames"]:
        trust.update(evidence_of(frame, 3))
    means = [a / (a + b) for a, b in trust.agent_beliefs]
    assert means == pytest.approx([0.64, 0.76, 0.80], abs=0.02)


def one_track(expected, detected, held, **view) -> OracleEvidence:
    columns = {name: np.array(values).reshape(-1, 1) for name, values in view.items() if name != "hits"}
    if "hits" in view:
        columns["hits"] = np.array(view["hits"])
    shape = [np.array(flags, dtype=bool).reshape(-1, 1) for flags in (expected, detected, held)]
    return OracleEvidence(np.array([7]), *shape, **columns)


def test_belief_moments():
    belief = Belief.of(0.8, 10.0)
    assert (belief.a, belief.b) == pytest.approx((8.0, 2.0))
    assert belief.mean == pytest.approx(0.8)
    assert belief.variance == pytest.approx(0.8 * 0.2 / 11.0)


def test_paper_preset_by_hand():
    trust = OracleTrust("paper", n_agents=2)
    trust.update(one_track([1, 1], [1, 0], [1, 0]))
    # Track: Beta(.5, .5) + .5 for each of the two; then E = 1/2, Var = 1/12 judge both agents alike.
    assert trust.track_beliefs[7] == pytest.approx((1.0, 1.0))
    assert trust.agent_beliefs == [pytest.approx((0.5 + 11 / 24, 0.5 + 11 / 24))] * 2
    trust.update(one_track([1, 0], [1, 0], [0, 1]))
    # One expected agent says nothing of the track; precision decays to 1.98. Agent 1 holds it out of view.
    assert trust.track_beliefs[7] == pytest.approx((0.99, 0.99))
    variance = 0.25 / (1.98 + 1.0)
    precision = 0.99 * (1.0 + 11 / 12)
    assert sum(trust.agent_beliefs[0]) == pytest.approx(precision + 1.0 - variance)
    assert sum(trust.agent_beliefs[1]) == pytest.approx(precision)


def test_precision_never_falls_below_the_prior():
    trust = OracleTrust("paper", n_agents=1, agent_priors={0: (0.8, 10.0)})
    for _ in range(5):
        trust.update(one_track([0], [0], [0]))
    assert trust.agent_beliefs[0] == pytest.approx((8.0, 2.0))
    assert trust.track_beliefs[7] == pytest.approx((0.5, 0.5))


def test_mate_preset_by_hand():
    trust = OracleTrust("mate", n_agents=2, dt=1.0, agent_priors={0: (0.8, 10.0)})
    view = {"distance": [0.9, 0.2], "in_a_row": [5, 3], "hits": [4]}
    trust.update(one_track([1, 1], [0, 1], [0, 1], **view))
    # Forgetting: a tenth of the way to Beta(.5, .5). The new track has that, so 1 - 2 std = 1 - 1/sqrt 2.
    agent_0, agent_1 = (7.25, 1.85), (0.5, 0.5)
    confidence = 1.0 - 2.0 * math.sqrt(0.125)
    weight = (5 - 3) / 3 * 0.5  # 63 m of 70 m away, 5 frames in a row
    # Both values are .5, not below .4, so n = 1 and every increment is halved.
    after_0 = [x + 0.5 * weight * confidence * 0.5 for x in agent_0]
    after_1 = [x + 0.5 * confidence * 0.5 for x in agent_1]
    assert trust.agent_beliefs[0] == pytest.approx(after_0)
    assert trust.agent_beliefs[1] == pytest.approx(after_1)
    mean_0, mean_1 = after_0[0] / sum(after_0), 0.5
    assert trust.track_beliefs[7] == pytest.approx((0.5 + mean_1, 0.5 + weight * mean_0))


@pytest.mark.parametrize(
    ("distance", "in_a_row", "hits", "weight"),
    [
        (0.2, 3, 2, 1.0),
        (0.2, 2, 2, 0.25),
        (0.6, 3, 2, 0.0),
        (0.6, 4, 2, 1 / 3),
        (0.6, 9, 2, 1.0),
        (0.6, 9, 1, 0.0),
        (0.9, 9, 2, 0.5),
        (1.1, 9, 2, None),
    ],
)
def test_mate_weight_of_a_negative(distance, in_a_row, hits, weight):
    trust = OracleTrust("mate", n_agents=1)
    evidence = one_track([1], [0], [0], distance=[distance], in_a_row=[in_a_row], hits=[hits])
    assert trust.weight(evidence, 0, 0) == (weight if weight is None else pytest.approx(weight))


def test_mate_negativity_bias_counts_distrust_more():
    trust = OracleTrust("mate", n_agents=1)
    belief = Belief(1.0, 1.0)
    trust.add_to_agent(belief, 0.3, 0.5)
    assert (belief.a, belief.b) == pytest.approx((1.0 + 0.8 * 0.15, 1.0 + 3.2 * 0.35))
    trust.add_to_agent(belief, 0.4, 0.5)
    assert (belief.a, belief.b) == pytest.approx((1.12 + 0.5 * 0.2, 2.12 + 0.5 * 0.3))


# --- Assignment ---------------------------------------------------------------------------------------------


def best_by_enumeration(allowed: np.ndarray, cost: np.ndarray) -> tuple[int, float]:
    """(most pairs, least cost) over every partial one-to-one map."""
    n_rows, n_columns = allowed.shape
    best = (0, 0.0)
    for columns in itertools.product(range(-1, n_columns), repeat=n_rows):
        pairs = [(r, c) for r, c in enumerate(columns) if c >= 0]
        distinct = len({c for _, c in pairs}) == len(pairs)
        if distinct and all(allowed[pair] for pair in pairs):
            best = min(best, (-len(pairs), sum(cost[pair] for pair in pairs)))
    return -best[0], best[1]


def test_assignment_is_the_best_of_all():
    rng = np.random.default_rng(5)
    for _ in range(300):
        shape = rng.integers(1, 5, size=2)
        allowed, cost = rng.random(shape) < 0.6, rng.normal(0.0, 10.0, shape)
        pairs = assign(allowed, cost)
        total = sum(cost[pair] for pair in pairs)
        n_pairs, least = best_by_enumeration(allowed, cost)
        assert len(pairs) == n_pairs
        assert total == pytest.approx(least)


def test_assignment_prefers_two_dear_pairs_to_one_cheap():
    allowed = np.array([[True, True], [True, False]])
    assert assign(allowed, np.array([[0.0, 9.0], [9.0, 0.0]])) == [(0, 1), (1, 0)]
    assert assign(np.zeros((2, 0), dtype=bool), np.zeros((2, 0))) == []


# --- Tracker ------------------------------------------------------------------------------------------------


def scan(*points: tuple[float, float]) -> np.ndarray:
    return np.array(points, dtype=float).reshape(-1, 2)


def test_birth_hit_and_miss_by_hand():
    tracker = OracleTracker(TrackerParams(initial_velocity_variance=0.0, process_noise=0.0))
    tracker.update([scan((1.0, 2.0))], [EVERYWHERE], [R5], dt=0.1)
    (track,) = tracker.tracks
    assert (track.id, track.status, track.age, track.hits) == (0, "tentative", 1, 1)
    assert track.score == pytest.approx(-7.0131158)
    tracker.update([scan((3.0, 2.0))], [EVERYWHERE], [R5], dt=0.1)
    # S = 2R, so d² = 4 / (2 sqrt 5), ΔL = g - ln 2 - d²/2; the mean moves half the way; P = R/2.
    assert track.score == pytest.approx(-7.0131158 + 11.0675535 - math.log(2.0) - 1.0 / math.sqrt(5.0), abs=1e-6)
    assert track.mean == pytest.approx([2.0, 2.0, 0.0, 0.0])
    assert track.cov[:2, :2] == pytest.approx(R5 / 2.0)
    before = track.score
    tracker.update([scan()], [EVERYWHERE], [R5], dt=0.1)
    assert track.score - before == pytest.approx(math.log(0.1))
    tracker.update([scan()], [NOWHERE], [R5], dt=0.1)
    assert track.score - before == pytest.approx(math.log(0.1))
    assert (track.unseen, track.age, track.hits) == (1, 4, 2)


def test_prediction_by_hand():
    tracker = OracleTracker(TrackerParams(process_noise=3.0, initial_velocity_variance=1.0))
    tracker.update([scan((0.0, 0.0))], [EVERYWHERE], [np.eye(2)], dt=1.0)
    tracker.predict(2.0)
    # P: 1 + 4·1 + 3·8/3, 2·1 + 3·4/2, 1 + 3·2 per axis
    axis = np.array([[13.0, 8.0], [8.0, 7.0]])
    assert tracker.tracks[0].cov == pytest.approx(np.kron(axis, np.eye(2)))


@pytest.mark.parametrize("order", ["A", "AB", "BA", "ABB", "BBA", "ABBB", "BBBA", "BBBBA", "AABBBBBB", "BBAA"])
def test_a_score_optimal_attack_confirms_in_the_frame_of_theory(order):
    tracker = OracleTracker(TrackerParams())
    frame = 0
    while not tracker.confirmed:
        frame += 1
        detections = [scan((0.0, 0.0)) if role == "A" else scan() for role in order]
        tracker.update(detections, [EVERYWHERE] * len(order), [R5] * len(order), dt=0.1)
    assert frame == theory.score_optimal_frames(order)


def test_a_track_that_no_attack_confirms_is_deleted_and_born_again():
    tracker = OracleTracker(TrackerParams())
    for _ in range(60):
        tracker.update([scan((0.0, 0.0))] + [scan()] * 6, [EVERYWHERE] * 7, [R5] * 7, dt=0.1)
        assert not tracker.confirmed
    assert tracker.next_id > 5


def test_a_track_just_outside_a_view_can_be_hit_but_not_missed():
    near = circle((0.0, 0.0), 10.0)
    tracker = OracleTracker(TrackerParams())
    tracker.update([scan((10.5, 0.0))], [EVERYWHERE], [np.eye(2)], dt=0.1)
    tracker.update([scan()], [near], [np.eye(2)], dt=0.1)
    assert tracker.tracks[0].score == pytest.approx(-7.0131158)
    tracker.update([scan((9.9, 0.0))], [near], [np.eye(2)], dt=0.1)
    assert [(track.id, track.hits) for track in tracker.tracks] == [(0, 2)]


def test_an_unseen_track_goes_after_five_frames():
    tracker = OracleTracker(TrackerParams())
    tracker.update([scan((0.0, 0.0))], [EVERYWHERE], [R5], dt=0.1)
    for _ in range(4):
        tracker.update([scan()], [NOWHERE], [R5], dt=0.1)
    assert len(tracker.tracks) == 1
    tracker.update([scan()], [NOWHERE], [R5], dt=0.1)
    assert tracker.tracks == []


def hits_and_misses(params: TrackerParams, pattern: str) -> OracleTracker:
    tracker = OracleTracker(params)
    for letter in pattern:
        tracker.update([scan((0.0, 0.0)) if letter == "h" else scan()], [EVERYWHERE], [R5], dt=0.1)
    return tracker


@pytest.mark.parametrize(
    ("rules", "pattern", "status"),
    [
        ({}, "hh", "tentative"),
        ({}, "hhh", "confirmed"),
        ({}, "hhhmmmm", "confirmed"),  # 9.21 nats below the maximum, 10 allowed
        ({}, "hhhmmmmm", None),
        ({}, "hm", "tentative"),  # 2.3 nats below, 4.5 allowed
        ({}, "hmm", None),
        (
            {"confirmation": "m_of_n", "confirm_m": 3, "confirm_n": 4, "tentative_drop": 99.0},
            "hmmhh",
            "tentative",
        ),
        (
            {"confirmation": "m_of_n", "confirm_m": 3, "confirm_n": 4, "tentative_drop": 99.0},
            "hmmhhh",
            "confirmed",
        ),
        ({"confirmation": "m_of_n", "confirm_m": 3, "confirm_n": 4}, "hmhh", "confirmed"),
        ({"confirmation": "score_or_hits", "confirm_hits": 2}, "hmh", "confirmed"),
        ({"confirmation": "score_or_hits", "confirm_hits": 2}, "h", "tentative"),
        ({"deletion": "relative"}, "hmm", None),  # -4.605170 < T_1 = -4.605070, by α alone
        ({"deletion": "relative"}, "hm", "tentative"),
        ({"deletion": "relative"}, "hhmmmm", "tentative"),
        ({"deletion": "absolute"}, "h", None),  # L_0 = -7.01 < T_1 = -4.61: the printed test
        ({"deletion": "absolute", "beta_nt": 1e-6}, "h", "tentative"),
        ({"deletion": "absolute", "beta_nt": 1e-6}, "hm", "tentative"),
        ({"deletion": "absolute", "beta_nt": 1e-6}, "hmm", None),
    ],
)
def test_confirmation_and_deletion_rules(rules, pattern, status):
    tracks = hits_and_misses(TrackerParams(**rules), pattern).tracks
    assert [track.status for track in tracks if track.id == 0] == ([] if status is None else [status])


def test_a_full_store_gives_up_its_lowest_tentative_track():
    params = TrackerParams(capacity=2, confirmation="score_or_hits", confirm_hits=3)
    tracker = OracleTracker(params)
    at = [(0.0, 0.0), (100.0, 0.0), (200.0, 0.0)]
    tracker.update([scan(*at[:2])], [EVERYWHERE], [R5], dt=0.1)
    tracker.update([scan(at[1])], [EVERYWHERE], [R5], dt=0.1)
    tracker.update([scan(at[1], at[2])], [EVERYWHERE], [R5], dt=0.1)
    # Track 0, missed twice, gave way to track 2; track 1 is confirmed by its third hit.
    assert [(track.id, track.status) for track in tracker.tracks] == [(1, "confirmed"), (2, "tentative")]
    for _ in range(2):
        tracker.update([scan(*at[1:])], [EVERYWHERE], [R5], dt=0.1)
    tracker.update([scan(*at)], [EVERYWHERE], [R5], dt=0.1)
    assert [track.id for track in tracker.tracks] == [1, 2]
    assert (tracker.evicted, tracker.dropped) == (1, 1)


def test_weights_inflate_the_noise_and_scale_the_score():
    tracker = OracleTracker(TrackerParams(initial_velocity_variance=0.0, process_noise=0.0))
    tracker.update([scan((0.0, 0.0))], [EVERYWHERE], [R5], dt=0.1)
    tracker.update([scan((0.0, 0.0))], [EVERYWHERE], [R5], dt=0.1, weights=[0.5])
    track = tracker.tracks[0]
    gain = 11.0675535 - math.log(3.0)  # S = R + R / 0.5
    assert track.score == pytest.approx(-7.0131158 + 0.5 * gain, abs=1e-6)
    tracker.update([scan((50.0, 0.0))], [EVERYWHERE], [R5], dt=0.1, weights=[1e-4])
    assert len(tracker.tracks) == 1
    assert track.score == pytest.approx(-7.0131158 + 0.5 * gain, abs=1e-6)
    assert track.contributed == {0: pytest.approx(track.score)}


# --- Evidence and the whole centre --------------------------------------------------------------------------


def test_fields_of_view():
    assert circle((1.0, 1.0), 1.0)(np.array([2.0, 1.0]))
    assert not circle((1.0, 1.0), 1.0)(np.array([2.0, 1.1]))
    ahead = sector((0.0, 0.0), 2.0, heading=math.pi, width=math.pi / 2)
    assert ahead(np.array([-1.0, 0.9])) and ahead(np.array([-1.0, -0.9]))
    assert not ahead(np.array([-1.0, 1.1])) and not ahead(np.array([-3.0, 0.0]))
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    for vertices in (square, square[::-1]):
        assert polygon(vertices)(np.array([0.5, 0.1])) and not polygon(vertices)(np.array([0.5, -0.1]))


def test_evidence_by_hand():
    central, local = (OracleTracker(TrackerParams(confirmation="m_of_n", confirm_m=1)) for _ in range(2))
    central.update([scan((0.0, 0.0), (5.0, 0.0), (20.0, 0.0))], [EVERYWHERE], [np.eye(2)], dt=0.1)
    local.update([scan((1.0, 0.0), (4.5, 0.0))], [EVERYWHERE], [np.eye(2)], dt=0.1)
    evidence = oracle_evidence(
        central.confirmed,
        [scan((0.0, 4.0), (5.0, 4.4)), scan((20.0, 4.4))],  # P + R = 2I: the gate reaches sqrt(18.42) = 4.29
        [local.tracks, []],
        [circle((0.0, 0.0), 10.0), NOWHERE],
        [np.eye(2)] * 2,
        near_distance=None,
        hold_distance=4.0,
    )
    assert evidence.track_id.tolist() == [0, 1, 2]
    assert evidence.expected.tolist() == [[True, True, False], [False] * 3]
    assert evidence.detected.tolist() == [[True, False, False], [False] * 3]
    assert evidence.held.tolist() == [[True, True, False], [False] * 3]
    near = oracle_evidence(
        central.confirmed,
        [scan((20.0, 4.4))],
        [[]],
        [NOWHERE],
        [np.eye(2)],
        near_distance=4.4,
        hold_distance=1.0,
    )
    assert near.detected.tolist() == [[False, False, True]]


def test_a_centre_tells_the_liar_from_the_honest():
    rng = np.random.default_rng(1)
    truth = scan((-20.0, 0.0), (20.0, 0.0), (0.0, 25.0))
    phantom = scan((0.0, -20.0))
    trust = OracleTrust("paper", n_agents=3)
    centre = OracleCentre(TrackerParams(), trust, hold_distance=5.0)
    for _ in range(40):
        reports = [truth + rng.normal(0.0, 0.5, truth.shape) for _ in range(3)]
        reports[0] = np.concatenate([reports[0], phantom])
        frame = centre.update(reports, [circle((0.0, 0.0), 50.0)] * 3, [0.25 * np.eye(2)] * 3, dt=0.1)
    trust_in = [a / (a + b) for a, b in frame.track_beliefs.values()]
    assert min(trust_in[:3]) > 0.9 and trust_in[3] < 0.4  # the phantom is confirmed, for R is small, but distrusted
    agents = [a / (a + b) for a, b in frame.agent_beliefs]
    assert agents[0] < min(agents[1:])
    assert [track.id for track in frame.tracks if track.confirmed] == frame.evidence.track_id.tolist()
    assert all(np.linalg.eigvalsh(track.cov).min() > 0.0 for track in frame.tracks)
