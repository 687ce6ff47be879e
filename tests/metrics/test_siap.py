"""SIAP of real episodes against Stone Soup's metric generator, and of a frame by hand."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest

import trust_env
from trust_env.agents import Player
from trust_env.metrics import EpisodeMetrics

FRAMES = 25
START = datetime(2024, 1, 1)


def played(attack: str, look=lambda venv: None):
    """An episode of two worlds of `patrol` against `trust`: its metrics, world 0's; `look` sees every frame."""
    venv = trust_env.vector_env("patrol", "trust", num_worlds=2, max_cycles=FRAMES, autoreset=False)
    player, metrics = Player(venv, {"adversary": attack}), EpisodeMetrics(venv)
    observations, _ = venv.reset(seed=8)
    for _ in range(FRAMES):
        observations, *_, info = venv.step(player.actions(observations))
        metrics.update(info)
        look(venv)
    return {name: values[0] for name, values in metrics.result().items()}


def nearest_within(points, others, reach):
    """For each point the nearest other one within reach, or None."""
    found = []
    for point in points:
        distances = np.linalg.norm(others[:, :2] - point[:2], axis=1)
        found.append(int(distances.argmin()) if len(others) and distances.min() <= reach else None)
    return found


@pytest.mark.extra("bench")
@pytest.mark.parametrize("attack", ["honest", "false_positive"])
def test_siap_equals_stone_soups(attack):
    from stonesoup.measures import Euclidean
    from stonesoup.metricgenerator.manager import MultiManager
    from stonesoup.metricgenerator.tracktotruthmetrics import SIAPMetrics
    from stonesoup.types.association import AssociationSet, TimeRangeAssociation
    from stonesoup.types.groundtruth import GroundTruthPath
    from stonesoup.types.state import State
    from stonesoup.types.time import TimeRange
    from stonesoup.types.track import Track

    tracks, truths, associations = [], [], []

    def look(venv):
        """Every track and target of a frame is an object of its own: without identities nothing else is told."""
        a, time = venv.arrays, START + timedelta(seconds=len(frames))
        frames.append(time)
        shown, alive = a.track_mean[0][a.published[0]], np.flatnonzero(a.scored_alive[0])
        targets = a.scored_state[0][alive]
        near = nearest_within(shown, targets, venv.scenario.metrics.match_distance)
        counted = sorted({*np.flatnonzero(a.scored_visible[0][alive]).tolist(), *(n for n in near if n is not None)})
        paths = {n: GroundTruthPath([State(targets[n].reshape(4, 1), timestamp=time)]) for n in counted}
        truths.extend(paths.values())
        for mean, n in zip(shown, near):
            tracks.append(Track([State(mean.reshape(4, 1), timestamp=time)]))
            if n is not None:
                moment = TimeRange(time, time + timedelta(milliseconds=1))
                associations.append(TimeRangeAssociation({tracks[-1], paths[n]}, moment))

    frames: list[datetime] = []
    found = played(attack, look)
    siap = SIAPMetrics(Euclidean(mapping=[0, 1]), Euclidean(mapping=[2, 3]))
    manager = MultiManager([siap])
    manager.add_data({"tracks": set(tracks), "groundtruth_paths": set(truths)})
    manager.association_set = AssociationSet(set(associations))
    theirs = {metric.title: metric.value for metric in siap.compute_metric(manager)}
    names = {
        "siap_completeness": "SIAP Completeness",
        "siap_ambiguity": "SIAP Ambiguity",
        "siap_spuriousness": "SIAP Spuriousness",
        "siap_position_error": "SIAP Position Accuracy",
        "siap_velocity_error": "SIAP Velocity Accuracy",
    }
    assert {name: found[name] for name in names} == pytest.approx({n: theirs[title] for n, title in names.items()})
    assert 0.0 < found["siap_completeness"] < 1.0
    assert attack == "honest" or found["siap_spuriousness"] > 0.05


@pytest.mark.core
def test_siap_of_frames_equals_plain_loops():
    """And several tracks near one target are all associated, where the assignment of `scoring` takes but one."""
    shared = 0

    def look(venv):
        nonlocal shared
        a, values, reach = venv.arrays, venv.worlds.metrics(), venv.scenario.metrics.match_distance
        for w in range(2):
            alive = a.scored_alive[w]
            targets, shown = a.scored_state[w][alive], a.track_mean[w][a.published[w]]
            near = nearest_within(shown, targets, reach)
            pairs = [(mean, n) for mean, n in zip(shown, near) if n is not None]
            tracked = {n for _, n in pairs}
            visible = set(np.flatnonzero(a.scored_visible[w][alive]).tolist())
            counts = [values[f"siap_{name}"][w] for name in ("targets", "tracked_targets", "tracks")]
            assert counts == [len(visible | tracked), len(tracked), len(pairs)]
            errors = [np.sum([np.linalg.norm((mean - targets[n])[part]) for mean, n in pairs])
                      for part in (slice(0, 2), slice(2, 4))]  # fmt: skip
            assert [values["siap_position_error"][w], values["siap_velocity_error"][w]] == pytest.approx(errors)
            shared += len(pairs) - len(tracked)

    played("false_positive", look)
    assert shared > 0
