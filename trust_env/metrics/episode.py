"""What an episode is judged by: the picture against the truth, and trust against who deserved it.

Rewards have no part in it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.special import expit

from trust_env.metrics.forecast_scores import Forecasts, auroc, ratio
from trust_env.metrics.gospa import Gospa, gospa, ospa

__all__ = ["METRICS", "EpisodeMetrics", "Gospa", "gospa", "ospa"]

WARM_UP = 10  # frames after which a target that some FOV holds should have its track

METRICS: dict[str, str] = {
    "false_tracks_per_frame": "tracks of the picture that match no target, mean over the frames",
    "injected_tracks_per_frame": "of those, the tracks that injections made",
    "missing_targets_per_frame": "targets that some FOV holds and the picture lacks, mean over the frames",
    "damage_per_frame": "false tracks and missing targets together",
    "missing_fraction": "share of the targets in some FOV that the picture lacks, after the first ten frames",
    "gospa": "GOSPA (alpha = 2) of the picture, m, mean over the frames",
    "ospa": "OSPA of the picture, m, mean over the frames",
    "frames_to_first_false_track": "first frame, from 1, that shows an injected track; horizon + 1: never",
    "adversary_auroc": "AUROC of 'agent is an adversary' by low mean trust over the episode",
    "false_accusation_rate": "share of benign agents whose trust ends below accuse_below",
    "detection_delay": "first frame that has an adversary's trust below accuse_below; horizon + 1: never",
    "track_auroc": "AUROC of 'confirmed track is a target' by its trust",
    "true_track_rejection_rate": "share of the confirmed tracks of targets that the defense rejects",
    "false_track_rejection_rate": "share of the confirmed tracks of nothing that the defense rejects",
    "existence_brier": "Brier score of the existence probability of confirmed tracks",
    "track_trust_brier": "Brier score of the trust in confirmed tracks",
    "agent_trust_brier": "Brier score of the trust in agents, all frames, benign = 1",
    "track_trust_calibration_error": "expected calibration error of track trust, ten bins",
    "agent_trust_calibration_error": "expected calibration error of agent trust, ten bins",
}
"""Names and meanings. A confirmed track counts in every frame, whether or not the defense shows it."""


class EpisodeMetrics:
    """Records one episode of every world of a `VectorEnv` (without autoreset) or of a `TrustEnv`.

    Call `update` after each `step`, then `result`. Memory: 13 bytes per confirmed track and frame, and some
    60 numbers per world.
    """

    def __init__(self, env: Any):
        env = getattr(env, "unwrapped", env)
        if getattr(env, "autoreset", False):
            raise ValueError("metrics need the last frame of an episode: make the environment with autoreset=False")
        self._worlds = env.worlds
        self._adversary = self._worlds.roles > 0  # bool[K]
        self._accuse_below = self._worlds.scenario.metrics.accuse_below
        self._never = self._worlds.horizon + 1.0
        self._frames = 0
        shape = (self._worlds.num_worlds, len(self._adversary))
        w = shape[0]
        self._false, self._injected, self._missing, self._gospa, self._ospa = np.zeros((5, w))
        self._late_missing, self._late_visible = np.zeros((2, w))
        self._first_injected, self._first_accused = np.full((2, w), self._never)
        self._trust_sum, self._opinions, self._last_trust = np.zeros((3, *shape))
        self._rejected, self._confirmed = np.zeros((2, 2, w))  # by label: false, true
        self._existence, self._track_trust, self._agent_trust = Forecasts(w), Forecasts(w), Forecasts(w)
        self._samples: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []  # worlds, trust, label of tracks

    def update(self, info: Mapping[str, Any] | None = None) -> None:
        """Take in a frame; `info` is what `VectorEnv.step` returned, or None to ask the worlds for it."""
        self._frames += 1
        self._update_picture(info if info is not None and "gospa" in info else self._worlds.metrics())
        self._update_tracks()
        self._update_agents()

    def _update_picture(self, values: Mapping[str, np.ndarray]) -> None:
        self._false += values["false_tracks"]
        self._injected += values["injected_tracks"]
        self._missing += values["missing_targets"]
        self._gospa += values["gospa"]
        self._ospa += values["ospa"]
        if self._frames > WARM_UP:
            self._late_missing += values["missing_targets"]
            self._late_visible += values["visible_targets"]
        shown = np.where(values["injected_tracks"] > 0, float(self._frames), np.inf)
        self._first_injected = np.minimum(self._first_injected, shown)

    def _update_tracks(self) -> None:
        a, n = self._worlds.arrays, self._worlds.num_worlds
        w, j = np.nonzero(a.scored_confirmed)
        label, rejected, trust = a.track_label[w, j] >= 0, ~a.publish[w, j], a.track_trust[w, j]
        for is_target in (0, 1):
            of_kind = label == is_target
            self._confirmed[is_target] += np.bincount(w[of_kind], minlength=n)
            self._rejected[is_target] += np.bincount(w[of_kind & rejected], minlength=n)
        self._existence.add(w, expit(a.track_score[w, j]), label)
        opinion = ~np.isnan(trust)
        sample = w[opinion], trust[opinion], label[opinion]
        self._track_trust.add(*sample)
        self._samples.append((sample[0].astype(np.uint32), *sample[1:]))

    def _update_agents(self) -> None:
        trust = self._worlds.arrays.agent_trust
        w, k = np.nonzero(~np.isnan(trust))
        self._agent_trust.add(w, trust[w, k], ~self._adversary[k])
        self._trust_sum[w, k] += trust[w, k]
        self._opinions[w, k] += 1
        self._last_trust[...] = trust
        accused = (trust[:, self._adversary] < self._accuse_below).any(axis=1)
        self._first_accused = np.minimum(self._first_accused, np.where(accused, float(self._frames), np.inf))

    def result(self) -> dict[str, np.ndarray]:
        """Every name of `METRICS`: float64[W], NaN where the episode gives no ground for it."""
        found = self._picture_result() | self._track_result() | self._agent_result()
        return {name: found[name] for name in METRICS}

    def _picture_result(self) -> dict[str, np.ndarray]:
        frames = np.full(len(self._false), self._frames)
        return {
            "false_tracks_per_frame": ratio(self._false, frames),
            "injected_tracks_per_frame": ratio(self._injected, frames),
            "missing_targets_per_frame": ratio(self._missing, frames),
            "damage_per_frame": ratio(self._false + self._missing, frames),
            "missing_fraction": ratio(self._late_missing, self._late_visible),
            "gospa": ratio(self._gospa, frames),
            "ospa": ratio(self._ospa, frames),
            "frames_to_first_false_track": self._first_injected,
        }

    def _track_result(self) -> dict[str, np.ndarray]:
        none = [(np.empty(0, np.uint32), np.empty(0), np.empty(0, bool))]
        worlds, trust, label = (np.concatenate(parts) for parts in zip(*(none + self._samples)))
        rejection = ratio(self._rejected, self._confirmed)
        return {
            "track_auroc": auroc(worlds, trust, label, len(self._false)),
            "true_track_rejection_rate": rejection[1],
            "false_track_rejection_rate": rejection[0],
            "existence_brier": self._existence.brier(),
            "track_trust_brier": self._track_trust.brier(),
            "track_trust_calibration_error": self._track_trust.calibration_error(),
        }

    def _agent_result(self) -> dict[str, np.ndarray]:
        mean = ratio(self._trust_sum, self._opinions)
        w, k = np.nonzero(~np.isnan(mean))
        benign = ~self._adversary
        judged_adversary = self._opinions[:, self._adversary].any(axis=1)
        judged_benign = ~np.isnan(self._last_trust[:, benign]).all(axis=1) & (self._frames > 0)
        accused = (self._last_trust[:, benign] < self._accuse_below).sum(axis=1)
        return {
            "adversary_auroc": auroc(w, -mean[w, k], self._adversary[k], len(mean)),
            "false_accusation_rate": ratio(accused, np.where(judged_benign, benign.sum(), 0)),
            "detection_delay": np.where(judged_adversary, self._first_accused, np.nan),
            "agent_trust_brier": self._agent_trust.brier(),
            "agent_trust_calibration_error": self._agent_trust.calibration_error(),
        }
