"""What the paper says of score and trust, on real aircraft trajectories."""

from __future__ import annotations

import numpy as np
import pytest
from paths import TRAFFIC

import trust_env
from trust_env.agents import Player


def injected_tracks_shown(defense: str, attack: str = "false_positive", worlds: int = 6) -> np.ndarray:
    """[4, 6, 2]: by reporting adversaries and honest observers, injected tracks confirmed, and those shown; a
    track counts once a frame.
    """
    scenario = trust_env.load_scenario("skies", **{"targets.data": str(TRAFFIC)})
    venv = trust_env.vector_env(scenario, defense, num_worlds=worlds, autoreset=False)
    player, a = Player(venv, {"adversary": attack}), venv.arrays
    adversary = np.array(scenario.roles) == "adversary"
    counts = np.zeros((4, 6, 2))
    observations, _ = venv.reset(seed=3)
    for frame in range(venv.max_cycles):
        observations, *_ = venv.step(player.actions(observations))
        injected = a.scored_confirmed & a.track_injected & (a.track_label < 0) & (a.track_age >= 5)
        reporters = (a.expected & a.detected)[:, adversary].sum(1)[injected]
        observers = a.expected[:, ~adversary].sum(1)[injected]
        np.add.at(counts[..., 0], (reporters, observers), 1)
        np.add.at(counts[..., 1], (reporters, observers), a.published[injected])
        if frame == 60:
            break
    return counts


@pytest.mark.skipif(not TRAFFIC.is_file(), reason="the recording in ../shared/data is not there")
def test_trust_hides_what_as_many_honest_agents_contradict_and_score_hides_nothing():
    reporters, observers = np.indices((4, 6))
    even = (reporters >= 1) & (observers == reporters)
    outnumbered = (reporters >= 1) & (observers > reporters)
    counts = {defense: injected_tracks_shown(defense, worlds=20) for defense in ("score", "trust")}
    for fewer, least in ((even, 4000), (outnumbered, 400)):
        confirmed, shown = counts["score"][fewer].sum(0)
        assert shown == confirmed > least
    confirmed, shown = counts["trust"][even].sum(0)
    assert shown < 0.25 * confirmed  # most of what is left are young tracks
    confirmed, shown = counts["trust"][outnumbered].sum(0)
    assert shown < 0.01 * confirmed


@pytest.mark.skipif(not TRAFFIC.is_file(), reason="the recording in ../shared/data is not there")
def test_a_lone_observer_cannot_be_contradicted():
    counts = injected_tracks_shown("trust")
    confirmed, shown = counts[1, 0]  # one adversary reports it, no honest agent can see it
    assert confirmed > 500
    assert shown == confirmed
