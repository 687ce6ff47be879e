"""Who is accused, who counts as an adversary from when on, and how many frames it takes, by hand."""

from __future__ import annotations

import numpy as np
import pytest

import trust_env
from trust_env.agents import Player
from trust_env.metrics import EpisodeMetrics
from trust_env.metrics.agent_record import AgentRecord

NAN = float("nan")
pytestmark = pytest.mark.core


def played(trust, first_edit, may_attack, frames_in_a_row=3):
    """The metrics of a world: trust[frame][agent]; first_edit[agent], 0: never."""
    record = AgentRecord(1, np.array(may_attack, bool), accuse_below=0.4, accuse_frames=frames_in_a_row)
    for frame, row in enumerate(trust, 1):
        so_far = [first if first <= frame else 0 for first in first_edit]
        record.update(frame, np.array([row], float), np.array([so_far]))
    return {name: values[0] for name, values in record.result().items()}


def test_three_frames_below_in_a_row_accuse_and_two_and_two_do_not():
    trust = np.full((8, 3), 0.9)
    trust[[1, 2, 4, 5], 1] = 0.3  # an interruption begins anew
    trust[[1, 2, 3], 2] = 0.3
    found = played(trust, (1, 0, 0), (True, False, False))
    assert found["false_accusation_rate"] == 0.5
    assert found["accusation_rate"] == 0.0


def test_trust_at_the_threshold_and_no_opinion_accuse_nobody():
    trust = np.full((6, 3), 0.4)
    trust[:, 1] = [0.1, 0.1, NAN, 0.1, 0.1, NAN]
    found = played(trust, (1, 0, 0), (True, False, False))
    assert (found["false_accusation_rate"], found["accusation_rate"]) == (0.0, 0.0)


def test_delay_counts_from_the_first_edit_to_the_first_frame_of_the_run():
    trust = np.full((12, 2), 0.9)
    trust[6:, 0] = 0.1  # frames 7 to 12
    assert played(trust, (4, 0), (True, False))["detection_delay"] == 3.0
    assert played(trust, (7, 0), (True, False))["detection_delay"] == 0.0


def test_low_trust_before_the_first_edit_is_held_against_nobody_who_attacks_later():
    """Accused as a benign agent in frames 1 to 5; of the six frames from the edit on none is low."""
    trust = np.full((11, 2), 0.75)
    trust[:5, 0] = 0.25
    found = played(trust, (6, 0), (True, False))
    assert (found["accusation_rate"], found["adversary_auroc"]) == (0.0, 0.5)
    assert np.isnan(found["detection_delay"])
    assert found["false_accusation_rate"] == 0.0
    # agent 0 counts as benign in five frames, as an adversary in six; agent 1 is benign
    assert found["agent_trust_brier"] == pytest.approx((5 * 0.75**2 + 6 * 0.75**2 + 11 * 0.25**2) / 22)


def test_a_run_that_lasts_over_the_first_edit_counts_from_it():
    trust = np.full((10, 2), 0.9)
    trust[2:, 0] = 0.1  # from frame 3; the edit is in frame 8, so that frames 8, 9, 10 make the run
    assert played(trust, (8, 0), (True, False))["detection_delay"] == 0.0
    assert np.isnan(played(trust, (9, 0), (True, False))["detection_delay"])


@pytest.mark.parametrize(
    ("accused_from", "delay"),
    [((5,), 4.0), ((5, None), 4.0), ((None, 5), 4.0), ((None,), NAN), ((3, 9, 6), 5.0), ((3, None, None), NAN)],
)
def test_delay_is_the_lower_median_and_who_is_never_accused_comes_last(accused_from, delay):
    trust = np.full((12, len(accused_from) + 1), 0.9)
    for k, frame in enumerate(accused_from):
        if frame is not None:
            trust[frame - 1 :, k] = 0.1
    adversaries = len(accused_from)
    found = played(trust, (*[1] * adversaries, 0), (*[True] * adversaries, False))
    np.testing.assert_equal(found["detection_delay"], delay)
    assert found["accusation_rate"] == sum(frame is not None for frame in accused_from) / adversaries


def test_where_nobody_edits_there_are_no_adversaries_and_all_are_benign():
    trust = np.full((6, 3), 0.9)
    trust[:, 0] = 0.1
    found = played(trust, (0, 0, 0), (True, False, False))
    absent = ("adversary_auroc", "adversary_average_precision", "accusation_rate", "detection_delay")
    assert all(np.isnan(found[name]) for name in absent)
    assert found["false_accusation_rate"] == pytest.approx(1 / 3)
    assert found["agent_trust_brier"] == pytest.approx((0.81 + 0.01 + 0.01) / 3)


def test_benign_agents_that_withhold_detections_are_no_adversaries():
    found = played(np.full((4, 2), 0.1), (0, 1), (True, False))
    assert np.isnan(found["accusation_rate"])
    assert found["false_accusation_rate"] == 1.0


def test_a_defense_without_opinions_gives_nothing():
    found = played(np.full((4, 2), NAN), (1, 0), (True, False))
    assert all(np.isnan(value) for value in found.values())


# --- first edits of real episodes ---------------------------------------------------------------------


def first_edits(attack: str, frames: int = 12) -> np.ndarray:
    """first_edit[W, K] after so many frames of `trio`, whose first agent is the adversary."""
    venv = trust_env.vector_env("trio", "score", num_worlds=6, autoreset=False)
    player, observations = Player(venv, {"adversary": attack}), venv.reset(seed=2)[0]
    assert not venv.arrays.first_edit.any()
    for _ in range(frames):
        observations, *_ = venv.step(player.actions(observations))
    return np.array(venv.arrays.first_edit)


def test_the_first_edit_is_the_frame_in_which_an_injection_was_made():
    for attack, frame in (("honest", 0), ("false_positive", 1), ("sleeper(start=5, inner=false_positive)", 6)):
        found = first_edits(attack)
        assert (found[:, 0] == frame).all()
        assert not found[:, 1:].any()


def test_a_suppression_is_an_edit_only_where_there_is_a_detection():
    venv = trust_env.vector_env("trio(sensor.p_detect=0.3)", "score", num_worlds=20, autoreset=False)
    venv.reset(seed=2)
    suppress = np.zeros((20, 3, venv.single_action_space.shape[0]), np.float32)
    suppress[:, 0, venv.action_table["suppressions"]] = 1.0
    seen = np.array(venv.arrays.raw_count)
    venv.step(suppress)
    np.testing.assert_array_equal(venv.arrays.first_edit[:, 0], (seen[:, 0] > 0).astype(int))
    assert (seen[:, 0] == 0).any() and (seen[:, 0] > 0).any()
    venv.reset(seed=2)
    assert not venv.arrays.first_edit.any()


def test_an_honest_control_has_no_adversaries():
    venv = trust_env.vector_env("patrol", "trust", num_worlds=4, max_cycles=30, autoreset=False)
    metrics, player = EpisodeMetrics(venv), Player(venv, {"adversary": "honest"})
    observations, _ = venv.reset(seed=1)
    for _ in range(30):
        observations, *_ = venv.step(player.actions(observations))
        metrics.update()
    found = metrics.result()
    for name in ("adversary_auroc", "adversary_average_precision", "accusation_rate", "detection_delay"):
        assert np.isnan(found[name]).all()
    assert not np.isnan(found["false_accusation_rate"]).any()
