"""How many frames a false positive needs to be confirmed: the track-score theory as functions of numbers.

Source: Hallyburton & Pajic 2024, "Bayesian Methods for Trust in Collaborative Multi-Agent Autonomy" (CDC),
Sec. III, with the track score of Sittler 1964 and Blackman 1986 (paper, Eqs. 4-7). Scores are natural-log
likelihood ratios.

| argument      | symbol | meaning                                                                  |
| ------------- | ------ | ------------------------------------------------------------------------ |
| n_adversaries | K_a    | number of adversaries, each of which hits the false positive every frame |
| n_benign      | K_b    | number of benign agents with the false positive in their FOV: they miss  |
| p_detect      | P_D    | probability that an agent detects a target inside its FOV, 0 < P_D < 1   |
| beta_fp       | β_FP   | density of natural false positives, per unit volume of measurement space |
| beta_nt       | β_NT   | density of new targets, per unit volume of measurement space             |
| det_r         | det R  | determinant of the measurement noise covariance                          |
| eta           | η      | dimension of a measurement                                               |
| alpha         | α      | probability that a false track is confirmed (Wald's test)                |
| beta          | β      | probability that a true track is deleted (Wald's test)                   |
"""

from trust_env.theory.confirmation import frames_to_confirm, sequential_frames_to_confirm
from trust_env.theory.gate import gate_false_positive_probability, gate_volume
from trust_env.theory.score import (
    ScoreThresholds,
    initial_score,
    max_hit_gain,
    max_score_change,
    score_thresholds,
)
from trust_env.theory.score_optimal import score_optimal_frames

__all__ = [
    "ScoreThresholds",
    "score_thresholds",
    "initial_score",
    "max_hit_gain",
    "max_score_change",
    "gate_volume",
    "gate_false_positive_probability",
    "frames_to_confirm",
    "sequential_frames_to_confirm",
    "score_optimal_frames",
]
