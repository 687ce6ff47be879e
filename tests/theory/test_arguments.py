"""Arguments that are not valid."""

import numpy as np
import pytest

from trust_env import theory


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
