"""Set distances and episode metrics, against hand-worked numbers, Stone Soup and plain loops."""

import itertools
import math
from datetime import datetime
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

import trust_env
from trust_env.agents import Player
from trust_env.batch import Arrays
from trust_env.metrics import METRICS, EpisodeMetrics, gospa, ospa
from trust_env.metrics.forecast_scores import Forecasts, auroc, average_precision
from trust_env.world.fields import FRAME_METRICS

NAN = float("nan")
pytestmark = pytest.mark.core

# --- GOSPA and OSPA -------------------------------------------------------------------------------


def test_set_distances_by_hand():
    """(0, 0) is 5 from the truth (3, 4), (10, 0) is farther than the cutoff 6, so it is false: 6²/2 = 18."""
    found = gospa([[0, 0], [10, 0]], [[3, 4]], cutoff=6)
    assert found == pytest.approx((math.sqrt(25 + 18), 25.0, 0.0, 18.0), abs=1e-12)
    assert ospa([[0, 0], [10, 0]], [[3, 4]], cutoff=6) == pytest.approx(math.sqrt((25 + 36) / 2), abs=1e-12)
    assert gospa([[0, 0], [10, 0]], [[3, 4]], cutoff=6, order=1) == pytest.approx((8.0, 5.0, 0.0, 3.0))
    assert ospa([[0, 0], [10, 0]], [[3, 4]], cutoff=6, order=1) == pytest.approx(5.5)


def test_set_distances_of_empty_sets():
    assert gospa([], [], cutoff=3) == (0.0, 0.0, 0.0, 0.0)
    assert ospa([], [], cutoff=3) == 0.0
    assert gospa([], [[0, 0], [1, 1]], cutoff=2) == pytest.approx((2.0, 0.0, 4.0, 0.0))
    assert gospa(np.empty((0, 2)), [[0, 0]], cutoff=2, order=1) == pytest.approx((1.0, 0.0, 1.0, 0.0))
    assert gospa([[5, 5]], [], cutoff=2) == pytest.approx((math.sqrt(2), 0.0, 0.0, 2.0))
    assert ospa([[5, 5], [6, 6]], [], cutoff=2) == ospa([], [[0, 0]], cutoff=2) == 2.0


def test_points_as_far_apart_as_the_cutoff_are_no_pair():
    assert gospa([[0, 0]], [[6, 0]], cutoff=6) == pytest.approx((6.0, 0.0, 18.0, 18.0))
    assert ospa([[0, 0]], [[6, 0]], cutoff=6) == pytest.approx(6.0)


def test_the_best_assignment_is_not_the_greedy_one():
    """Greedy pairs 1 with 1.5, then 0 with 9: 0.5² + 9² = 81.25. The other way it is 1.5² + 8² = 66.25."""
    assert gospa([[0, 0], [1, 0]], [[1.5, 0], [9, 0]], cutoff=100).localisation == pytest.approx(66.25)


def _random_sets(rng, count):
    for _ in range(count):
        n, m = rng.integers(0, 11, 2)
        yield rng.normal(0.0, 30.0, (n, 2)), rng.normal(0.0, 30.0, (m, 2))
    yield np.zeros((3, 2)), np.zeros((3, 2))
    yield np.zeros((4, 2)), rng.normal(0.0, 1.0, (1, 2))


def _states(points):
    from stonesoup.types.state import State

    return [State(point.reshape(2, 1), timestamp=datetime(2024, 1, 1)) for point in points]


@pytest.mark.extra("bench")
@pytest.mark.parametrize("order", [1.0, 2.0, 3.5])
def test_gospa_equals_stone_soups(order):
    from stonesoup.metricgenerator.ospametric import GOSPAMetric

    theirs = GOSPAMetric(p=order, c=30.0)
    for x, y in _random_sets(np.random.default_rng(0), 150):
        if len(x) + len(y) == 0:
            continue  # Stone Soup takes the time from the states and fails without any
        value = theirs.compute_gospa_metric(_states(x), _states(y))[0].value
        expected = [value[name] for name in ("distance", "localisation", "missed", "false")]
        assert gospa(x, y, cutoff=30.0, order=order) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.extra("bench")
@pytest.mark.parametrize("order", [1.0, 2.0, 3.5])
def test_ospa_equals_stone_soups(order):
    """Stone Soup assigns by d, whatever the order; given d^p as its measure it does as the metric wants."""
    from stonesoup.measures import Euclidean
    from stonesoup.metricgenerator.ospametric import OSPAMetric

    euclidean = Euclidean()
    theirs = OSPAMetric(c=30.0**order, p=1, measure=lambda a, b: euclidean(a, b) ** order)
    for x, y in _random_sets(np.random.default_rng(1), 150):
        if len(x) + len(y) == 0:
            continue
        expected = theirs.compute_OSPA_distance(_states(x), _states(y)).value ** (1.0 / order)
        assert ospa(x, y, cutoff=30.0, order=order) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.extra("bench")
def test_ospa_is_the_minimum_where_stone_soups_is_not():
    """Its value at p = 2 is never below ours, and ours is what trying all assignments gives."""
    from stonesoup.metricgenerator.ospametric import OSPAMetric

    theirs, higher = OSPAMetric(c=30.0, p=2), 0
    rng = np.random.default_rng(0)
    for _ in range(200):
        x, y = rng.normal(0.0, 30.0, (5, 2)), rng.normal(0.0, 30.0, (5, 2))
        d2 = np.minimum(np.linalg.norm(x[:, None] - y, axis=-1), 30.0) ** 2
        least = min(sum(d2[i, p[i]] for i in range(5)) for p in itertools.permutations(range(5)))
        assert ospa(x, y, cutoff=30.0) == pytest.approx(math.sqrt(least / 5), abs=1e-9)
        value = theirs.compute_OSPA_distance(_states(x), _states(y)).value
        assert value >= ospa(x, y, cutoff=30.0) - 1e-9
        higher += value > ospa(x, y, cutoff=30.0) + 1e-6
    assert higher > 0


def test_set_distances_of_large_sets():
    rng = np.random.default_rng(2)
    x, y = rng.uniform(0, 100, (150, 2)), rng.uniform(0, 100, (180, 2))
    cost = np.minimum(np.linalg.norm(x[:, None] - y, axis=-1), 8.0) ** 2
    least = cost[linear_sum_assignment(cost)].sum()
    assert gospa(x, y, cutoff=8.0).distance == pytest.approx(math.sqrt(least + 30 * 32.0), rel=1e-9)
    assert ospa(x, y, cutoff=8.0) == pytest.approx(math.sqrt((least + 30 * 64.0) / 180), rel=1e-9)


@pytest.mark.parametrize(("cutoff", "order"), [(1e-6, 30.0), (1e9, 30.0), (50.0, 100.0), (1e-3, 1.0), (7e7, 2.5)])
def test_set_distances_stay_finite_for_every_order_and_cutoff(cutoff, order):
    """Two pairs at c/2, one truth missed: GOSPA = c (2/2^p + 1/2)^(1/p), OSPA = c ((2/2^p + 1)/3)^(1/p)."""
    truths = cutoff * np.array([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0]])
    estimates = truths[:2] + np.array([0.0, 0.5 * cutoff])
    found = gospa(estimates, truths, cutoff, order)
    assert found.distance == pytest.approx(cutoff * (2 * 0.5**order + 0.5) ** (1 / order), rel=1e-9)
    assert ospa(estimates, truths, cutoff, order) == pytest.approx(
        cutoff * ((2 * 0.5**order + 1) / 3) ** (1 / order), rel=1e-9
    )
    assert found.localisation == pytest.approx(2 * (0.5 * cutoff) ** order, rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (([[0, 0, 0]], [], 1.0), r"estimates must be finite positions of shape \[n, 2\]; got shape \[1, 3\]"),
        (([], [[NAN, 0]], 1.0), "truths must be finite positions"),
        (([], [], 0.0), "cutoff must be a number above 0; got 0.0"),
        (([], [], NAN), "cutoff must be a number above 0; got nan"),
        (([], [], 1.0, 0.5), "order must be a number from 1 to 100; got 0.5"),
        (([], [], 1.0, 101.0), "order must be a number from 1 to 100; got 101.0"),
        (([], [], 1e200, 2.0), r"cutoff\*\*order must lie between 2\*\*-1000 and 2\*\*1000; got 1e\+200\*\*2.0"),
    ],
)
def test_set_distances_refuse(arguments, text):
    for distance in (gospa, ospa):
        with pytest.raises(ValueError, match=text):
            distance(*arguments)


# --- ratings --------------------------------------------------------------------------------------


def test_auroc_by_hand():
    """World 0: of the pairs (.9, .5), (.9, .1), (.3, .5), (.3, .1) three are in order. 1: a tie.
    World 2 lacks negatives, world 3 any sample."""
    worlds = np.array([0, 1, 0, 0, 2, 1, 0])
    scores = np.array([0.9, 0.4, 0.5, 0.3, 0.7, 0.4, 0.1])
    positive = np.array([1, 1, 0, 1, 1, 0, 0], dtype=bool)
    np.testing.assert_array_equal(auroc(worlds, scores, positive, 4), [0.75, 0.5, NAN, NAN])
    assert np.isnan(auroc(worlds[:0], scores[:0], positive[:0], 2)).all()
    found = auroc(np.array([0, 0, 1, 1]), np.array([0.1, 0.5, 0.5, 0.9]), np.array([False, True] * 2), 2)
    assert found.tolist() == [1.0, 1.0]  # equal scores of different worlds are no tie


def test_auroc_counts_pairs():
    rng = np.random.default_rng(0)
    worlds, positive = rng.integers(0, 5, 400), rng.random(400) < 0.3
    scores = rng.integers(0, 20, 400) / 20.0  # many ties
    found = auroc(worlds, scores, positive, 5)
    for w in range(5):
        up, down = scores[(worlds == w) & positive], scores[(worlds == w) & ~positive]
        pairs = [(a > b) + 0.5 * (a == b) for a in up for b in down]
        assert found[w] == pytest.approx(np.mean(pairs), abs=1e-12)


def test_average_precision_by_hand():
    """World 0: of positives at 0.9, 0.5 and 0.2 the precisions are 1, 2/4 (two share 0.5), 3/5. World 1 lacks
    negatives, world 2 any sample."""
    scores = np.array([[0.9, 0.5, 0.5, 0.2, 0.7, NAN], [0.1, 0.2, NAN, NAN, NAN, NAN], [NAN] * 6])
    positive = np.array([[1, 1, 0, 1, 0, 1], [1, 1, 0, 0, 0, 0], [0] * 6], bool)
    np.testing.assert_allclose(average_precision(scores, positive), [(1 + 2 / 4 + 3 / 5) / 3, NAN, NAN], rtol=1e-15)


def test_forecasts_by_hand():
    """0.12 and 0.18 share a bin: |0.30 - 1| / 4; 1.0 and 0.95 the last: |1.95 - 1| / 4; in all 1.65 / 4."""
    forecasts = Forecasts(2)
    forecasts.add(np.array([0, 0]), np.array([0.12, 1.0]), np.array([True, True]))
    forecasts.add(np.array([0, 0]), np.array([0.18, 0.95]), np.array([False, False]))
    assert forecasts.calibration_error()[0] == pytest.approx(1.65 / 4)
    assert forecasts.brier()[0] == pytest.approx((0.88**2 + 0.0 + 0.18**2 + 0.95**2) / 4)
    assert np.isnan(forecasts.brier()[1])
    assert np.isnan(forecasts.calibration_error()[1])


# --- an episode, by hand --------------------------------------------------------------------------


class _FakeWorlds:
    """Two worlds of agents adversary, benign, benign with three track columns, set by hand frame by frame."""

    num_worlds, horizon = 2, 12
    roles = np.array([1, -1, -1])
    scenario = SimpleNamespace(metrics=SimpleNamespace(accuse_below=0.4, accuse_frames=3))

    def __init__(self):
        self.arrays = SimpleNamespace(
            scored_confirmed=np.zeros((2, 3), bool),
            track_label=np.full((2, 3), -1),
            track_trust=np.full((2, 3), NAN),
            track_score=np.zeros((2, 3)),
            publish=np.ones((2, 3), bool),
            agent_trust=np.full((2, 3), NAN),
            first_edit=np.zeros((2, 3), int),
            published=np.zeros((2, 3), bool),
            track_target=np.full((2, 3), -1),
            track_injected=np.zeros((2, 3), bool),
            track_watchers=np.zeros((2, 3, 2), int),
            scored_watchers=np.zeros((2, 1, 2), int),
            scored_missing=np.zeros((2, 1), bool),
        )
        self.now = {}

    def metrics(self):
        return self.now


def _frame(**values):
    return {name: np.array(values.get(name, (0.0, 0.0)), dtype=float) for name in FRAME_METRICS}


def _by_hand():
    """Twelve frames. World 0: tracks and opinions; world 1: nothing at all."""
    worlds = _FakeWorlds()
    metrics, a = EpisodeMetrics(SimpleNamespace(worlds=worlds, autoreset=False)), worlds.arrays
    for frame in range(1, 13):
        worlds.now = _frame(
            false_tracks=(2.0 if frame >= 3 else 0.0, 0.0),
            injected_tracks=(1.0 if frame >= 4 else 0.0, 0.0),
            missing_targets=(1.0, 0.0),
            visible_targets=(4.0 if frame < 12 else 6.0, 0.0),
            gospa=(frame, 3.0),
            gospa_localisation=(4.0, 0.0),
            gospa_missed=(5.0, 0.0),
            gospa_false=(6.0, 0.0),
            ospa=(2.0, 0.0),
            published_tracks=(5.0, 0.0),
            siap_targets=(4.0, 0.0),
            siap_tracked_targets=(2.0, 0.0),
            siap_tracks=(3.0, 0.0),
            siap_position_error=(frame, 0.0),
            siap_velocity_error=(6.0, 0.0),
        )
        a.scored_confirmed[0] = [True, True, frame >= 4]
        a.track_label[0] = [5, -1, -1]
        a.track_score[0] = [0.0, math.log(3.0), -math.log(3.0)]  # existence 1/2, 3/4, 1/4
        a.track_trust[0] = [0.9, 0.25, NAN]
        a.publish[0] = [frame != 2, False, True]
        a.first_edit[0, 0] = 3 if frame >= 3 else 0
        a.agent_trust[0] = [0.5 if frame < 7 else 0.2, 0.8, NAN if frame < 12 else 0.1]
        metrics.update(worlds.now if frame % 2 else None)
    return metrics.result()


def test_episode_metrics_by_hand():
    found = {name: values[0] for name, values in _by_hand().items()}
    assert found == pytest.approx(
        {
            "false_tracks_per_frame": 2 * 10 / 12,
            "injected_tracks_per_frame": 9 / 12,
            "missing_targets_per_frame": 1.0,
            "damage_per_frame": 1 + 20 / 12,
            "missing_fraction": 2 / (4 + 6),  # frames 11 and 12
            "gospa": 6.5,
            "gospa_localisation": 4.0,
            "gospa_missed": 5.0,
            "gospa_false": 6.0,
            "ospa": 2.0,
            "siap_completeness": 2 / 4,
            "siap_ambiguity": 3 / 2,
            "siap_spuriousness": 2 / 5,
            "siap_position_error": 6.5 / 3,
            "siap_velocity_error": 6 / 3,
            "frames_to_first_false_track": 4.0,
            "adversary_auroc": 0.5,  # (4 · 0.5 + 6 · 0.2) / 10 from the first edit on lies below 0.8, not below 0.1
            "adversary_average_precision": 0.5,
            "accusation_rate": 1.0,  # from frame 7 on
            "false_accusation_rate": 0.0,  # one frame is not three
            "detection_delay": 4.0,  # since frame 3
            "track_auroc": 1.0,
            "true_track_rejection_rate": 1 / 12,
            "false_track_rejection_rate": 12 / 21,
            "existence_brier": (12 * 0.25 + 12 * 0.5625 + 9 * 0.0625) / 33,
            "track_trust_brier": (0.1**2 + 0.25**2) / 2,
            "agent_trust_brier": (6 * 0.5**2 + 6 * 0.2**2 + 12 * 0.2**2 + 0.9**2) / 25,
            "track_trust_calibration_error": (12 * 0.1 + 12 * 0.25) / 24,
            "agent_trust_calibration_error": (abs(6 * 0.5 - 2) + 6 * 0.2 + 12 * 0.2 + 0.9) / 25,
        },
        abs=1e-12,
    )


def test_what_an_episode_gives_no_ground_for_is_nan():
    found = {name: values[1] for name, values in _by_hand().items()}
    defined = {name: value for name, value in found.items() if not np.isnan(value)}
    assert defined == {
        "false_tracks_per_frame": 0.0,
        "injected_tracks_per_frame": 0.0,
        "missing_targets_per_frame": 0.0,
        "damage_per_frame": 0.0,
        "gospa": 3.0,
        "gospa_localisation": 0.0,
        "gospa_missed": 0.0,
        "gospa_false": 0.0,
        "ospa": 0.0,
    }


# --- real episodes --------------------------------------------------------------------------------


def _play(env, attack, frames, look):
    player, observations = Player(env, {"adversary": attack}), env.reset(seed=5)[0]
    for _ in range(frames):
        observations, *_, info = env.step(player.actions(observations))
        look(info)


def _plainly(frames, scenario):
    """The metrics of one world from copies of its arrays, with loops."""
    settings = scenario.metrics
    edits = frames[-1].first_edit
    adversaries = {k: edits[k] for k, role in enumerate(scenario.roles) if role == "adversary" and edits[k] > 0}
    benign = [k for k in range(len(scenario.roles)) if k not in adversaries]
    tracks = [
        (f.track_trust[j], f.track_label[j] >= 0, bool(f.publish[j]), 1 / (1 + math.exp(-f.track_score[j])))
        for f in frames
        for j in range(len(f.track_label))
        if f.scored_confirmed[j]
    ]
    agents = [
        (f.agent_trust[k], i < adversaries.get(k, math.inf))
        for i, f in enumerate(frames, 1)
        for k in range(len(scenario.roles))
    ]
    trust = {k: [f.agent_trust[k] for f in frames] for k in range(len(scenario.roles))}
    accused = {
        k: _accused_from(trust[k], adversaries.get(k, 1), settings.accuse_below, settings.accuse_frames) for k in trust
    }
    delays = sorted(accused[k] - first for k, first in adversaries.items())
    injected = [i for i, f in enumerate(frames, 1) if f.now["injected_tracks"] > 0]
    late = frames[10:]
    mean = {k: np.mean(trust[k][adversaries.get(k, 1) - 1 :]) for k in trust}
    true, false = [t for t in tracks if t[1]], [t for t in tracks if not t[1]]
    total = {name: sum(f.now[name] for f in frames) for name in FRAME_METRICS}
    return {
        "damage_per_frame": (total["false_tracks"] + total["missing_targets"]) / len(frames),
        "false_tracks_per_frame": total["false_tracks"] / len(frames),
        "injected_tracks_per_frame": total["injected_tracks"] / len(frames),
        "missing_targets_per_frame": total["missing_targets"] / len(frames),
        "missing_fraction": sum(f.now["missing_targets"] for f in late) / sum(f.now["visible_targets"] for f in late),
        "gospa": total["gospa"] / len(frames),
        "gospa_localisation": total["gospa_localisation"] / len(frames),
        "gospa_missed": total["gospa_missed"] / len(frames),
        "gospa_false": total["gospa_false"] / len(frames),
        "ospa": total["ospa"] / len(frames),
        "siap_completeness": total["siap_tracked_targets"] / total["siap_targets"],
        "siap_ambiguity": total["siap_tracks"] / total["siap_tracked_targets"],
        "siap_spuriousness": 1 - total["siap_tracks"] / total["published_tracks"],
        "siap_position_error": total["siap_position_error"] / total["siap_tracks"],
        "siap_velocity_error": total["siap_velocity_error"] / total["siap_tracks"],
        "frames_to_first_false_track": injected[0] if injected else NAN,
        "adversary_auroc": _pairs_in_order([mean[b] for b in benign], [mean[a] for a in adversaries]),
        "adversary_average_precision": np.mean(
            [np.mean([k in adversaries for k in mean if mean[k] <= mean[a]]) for a in adversaries]
        ),
        "accusation_rate": np.mean([accused[k] < math.inf for k in adversaries]),
        "false_accusation_rate": np.mean([accused[k] < math.inf for k in benign]),
        "detection_delay": delay if (delay := delays[(len(delays) - 1) // 2]) < math.inf else NAN,
        "track_auroc": _pairs_in_order([t[0] for t in true], [t[0] for t in false]),
        "true_track_rejection_rate": np.mean([not t[2] for t in true]),
        "false_track_rejection_rate": np.mean([not t[2] for t in false]),
        "existence_brier": np.mean([(t[3] - t[1]) ** 2 for t in tracks]),
        "track_trust_brier": np.mean([(t[0] - t[1]) ** 2 for t in tracks]),
        "track_trust_calibration_error": _calibration_error([(t[0], t[1]) for t in tracks]),
        "agent_trust_brier": np.mean([(t - b) ** 2 for t, b in agents]),
        "agent_trust_calibration_error": _calibration_error(agents),
    }


def _accused_from(trust, first, below, length):
    """The first frame, from `first` on, at which trust stays below for so many frames; inf: there is none."""
    starts = range(first, len(trust) - length + 2)
    return next((i for i in starts if all(t < below for t in trust[i - 1 : i - 1 + length])), math.inf)


def _pairs_in_order(high, low):
    return np.mean([(a > b) + 0.5 * (a == b) for a in high for b in low])


def _calibration_error(samples):
    total = 0.0
    for b in range(10):
        inside = [(p, y) for p, y in samples if b / 10 <= p < (b + 1) / 10 or (b == 9 and p == 1.0)]
        if inside:
            total += len(inside) * abs(np.mean([p for p, _ in inside]) - np.mean([y for _, y in inside]))
    return total / len(samples)


def test_episode_metrics_of_a_batch_equal_plain_loops():
    scenario = "patrol(metrics={'accuse_below': 0.5, 'accuse_frames': 4})"
    venv = trust_env.vector_env(scenario, "trust", num_worlds=6, max_cycles=40, autoreset=False)
    metrics, copies = EpisodeMetrics(venv), []

    def look(info):
        metrics.update(info)
        copies.append({name: np.array(view) for name, view in venv.arrays.items()} | {"now": venv.worlds.metrics()})

    _play(venv, "sleeper(start=7, inner=false_positive)", 40, look)
    found = metrics.result()
    assert tuple(found) == tuple(METRICS)
    for w in range(6):
        frames = [SimpleNamespace(**{name: copy[name][w] for name in copy if name != "now"}) for copy in copies]
        for frame, copy in zip(frames, copies):
            frame.now = {name: values[w] for name, values in copy["now"].items()}
        expected = _plainly(frames, venv.scenario)
        assert {name: values[w] for name, values in found.items()} == pytest.approx(expected, abs=1e-9, nan_ok=True)
    delay = found["detection_delay"]
    assert np.isnan(delay).any() and np.unique(delay[~np.isnan(delay)]).size > 1


def test_one_world_gives_what_its_row_in_a_batch_gives():
    venv = trust_env.vector_env("trio", "majority", num_worlds=4, max_cycles=30, autoreset=False)
    batch = EpisodeMetrics(venv)
    _play(venv, "optimal_false_positive", 30, batch.update)
    env = trust_env.parallel_env("trio", "majority", max_cycles=30)
    alone, player = EpisodeMetrics(env), Player(env, {"adversary": "optimal_false_positive"})
    observations, _ = env.reset(seed=5, options={"world": 2, "episode": 0})
    while env.agents:
        observations, *_, infos = env.step(player.actions(observations))
        alone.update(infos)
    row = {name: values[2] for name, values in batch.result().items()}
    assert {name: values[0] for name, values in alone.result().items()} == pytest.approx(row, nan_ok=True, abs=0)


def test_the_frames_gospa_is_the_functions():
    """The picture against the targets that some FOV holds or a track of the picture is assigned to."""
    env = trust_env.parallel_env("patrol", "trust", max_cycles=30)
    player, observations = Player(env, {"adversary": "false_positive"}), env.reset(seed=3)[0]
    a: Arrays = env.arrays
    settings = env.scenario.metrics
    for _ in range(30):
        observations, *_ = env.step(player.actions(observations))
        counted = a.scored_visible[0].copy()
        counted[a.track_target[0][a.published[0] & (a.track_target[0] >= 0)]] = True
        x, y = a.track_mean[0][a.published[0], :2], a.scored_state[0][counted, :2]
        distance, *parts = gospa(x, y, settings.cutoff, settings.order)
        values = env.worlds.metrics()
        assert values["gospa"][0] == pytest.approx(distance, abs=1e-9)
        shown = [values[f"gospa_{part}"][0] for part in ("localisation", "missed", "false")]
        assert shown == pytest.approx(parts, abs=1e-9)
        assert values["ospa"][0] == pytest.approx(ospa(x, y, settings.cutoff, settings.order), abs=1e-9)


def test_metrics_need_the_last_frame():
    venv = trust_env.vector_env("trio", "trust", num_worlds=2)
    with pytest.raises(ValueError, match="autoreset=False"):
        EpisodeMetrics(venv)
