"""Summaries of metrics: the worst tenth, and what is said where a value means "never"."""

from __future__ import annotations

import numpy as np
import pytest

from trust_env.metrics import METRICS
from trust_env.training.evaluation.summary import summarise, worst_decile_mean

NAN = float("nan")


def of(**metrics):
    """A summary of the given metrics of a cell in which the others are absent."""
    n = len(next(iter(metrics.values())))
    return summarise({name: np.array(metrics.get(name, [NAN] * n), float) for name in METRICS})


def test_worst_tenth_by_hand():
    """Of 20 episodes two, of 21 three, of 5 one."""
    values = np.arange(20.0)
    assert worst_decile_mean(values, None, "higher") == 18.5
    assert worst_decile_mean(values, None, "lower") == 0.5
    assert worst_decile_mean(np.arange(21.0), None, "higher") == 19.0
    assert worst_decile_mean(np.array([3.0, NAN, 9.0, 1.0, 2.0, NAN, 0.0]), None, "higher") == 9.0


def test_the_interquartile_mean_hides_the_episodes_that_the_worst_tenth_shows():
    found = of(damage_per_frame=[1.0] * 16 + [21.0] * 4)["damage_per_frame"]
    assert (found.iqm, found.mean, found.worst_decile) == (1.0, 5.0, 21.0)
    assert found.low == 1.0 and found.mean_low > 1.0
    assert found.never is None and "never" not in found.to_dict()


def test_the_worst_tenth_goes_by_the_metrics_own_direction():
    values = list(np.arange(20.0))
    found = of(adversary_auroc=values, gospa=values)
    assert (found["adversary_auroc"].worst_decile, found["gospa"].worst_decile) == (0.5, 18.5)


def test_no_number_stands_for_never():
    """A first false track in half of the episodes, the worst of which are the early ones."""
    shown = [1.0] * 20
    found = of(injected_tracks_per_frame=shown, frames_to_first_false_track=[5.0, 7.0] + [9.0] * 8 + [NAN] * 10)
    first = found["frames_to_first_false_track"]
    assert (first.never, first.mean, first.iqm, first.worst_decile) == (0.5, 8.4, 9.0, 6.0)
    never = of(injected_tracks_per_frame=shown, frames_to_first_false_track=[NAN] * 20)["frames_to_first_false_track"]
    assert never.never == 1.0
    assert set(list(never.to_dict().values())[:-1]) == {None}


def test_never_accused_is_the_worst_delay_and_no_adversary_is_none():
    """20 episodes: two without adversaries, one in which most are never accused."""
    rates = [NAN, NAN, 0.0] + [1.0] * 17
    delays = [NAN, NAN, NAN] + [4.0] * 17
    found = of(accusation_rate=rates, detection_delay=delays)["detection_delay"]
    assert found.never == pytest.approx(1 / 18)
    assert (found.mean, found.iqm) == (4.0, 4.0)
    assert np.isnan(found.worst_decile) and found.to_dict()["worst_decile"] is None
    assert "detection_delay" not in of(accusation_rate=[NAN] * 4, detection_delay=[NAN] * 4)
