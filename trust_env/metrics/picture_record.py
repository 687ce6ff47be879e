"""The picture against the truth over an episode."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from trust_env.metrics.forecast_scores import ratio

WARM_UP = 10  # frames after which a target that some FOV holds should have its track
_SUMMED = (
    "false_tracks", "injected_tracks", "missing_targets", "published_tracks", "gospa", "ospa",
    "gospa_localisation", "gospa_missed", "gospa_false",
    "siap_targets", "siap_tracked_targets", "siap_tracks", "siap_position_error", "siap_velocity_error",
)  # fmt: skip


class PictureRecord:
    """Sums over the frames of W worlds of what `trust_env.world.fields.FRAME_METRICS` tells of each."""

    def __init__(self, n_worlds: int):
        self._sums = {name: np.zeros(n_worlds) for name in _SUMMED}
        self._late_missing, self._late_visible = np.zeros((2, n_worlds))
        self._first_injected = np.full(n_worlds, math.inf)

    def update(self, frame: int, values: Mapping[str, np.ndarray]) -> None:
        """Take in frame `frame`, from 1: every frame metric by name, [W]."""
        for name, total in self._sums.items():
            total += values[name]
        if frame > WARM_UP:
            self._late_missing += values["missing_targets"]
            self._late_visible += values["visible_targets"]
        self._first_injected[(values["injected_tracks"] > 0) & np.isinf(self._first_injected)] = frame

    def result(self, frames: int) -> dict[str, np.ndarray]:
        """The metrics of the picture after so many frames, float64[W] each."""
        sums, count = self._sums, np.full(len(self._first_injected), frames)
        return {
            "damage_per_frame": ratio(sums["false_tracks"] + sums["missing_targets"], count),
            "false_tracks_per_frame": ratio(sums["false_tracks"], count),
            "injected_tracks_per_frame": ratio(sums["injected_tracks"], count),
            "missing_targets_per_frame": ratio(sums["missing_targets"], count),
            "missing_fraction": ratio(self._late_missing, self._late_visible),
            "gospa": ratio(sums["gospa"], count),
            "gospa_localisation": ratio(sums["gospa_localisation"], count),
            "gospa_missed": ratio(sums["gospa_missed"], count),
            "gospa_false": ratio(sums["gospa_false"], count),
            "ospa": ratio(sums["ospa"], count),
            "siap_completeness": ratio(sums["siap_tracked_targets"], sums["siap_targets"]),
            "siap_ambiguity": ratio(sums["siap_tracks"], sums["siap_tracked_targets"]),
            "siap_spuriousness": ratio(sums["published_tracks"] - sums["siap_tracks"], sums["published_tracks"]),
            "siap_position_error": ratio(sums["siap_position_error"], sums["siap_tracks"]),
            "siap_velocity_error": ratio(sums["siap_velocity_error"], sums["siap_tracks"]),
            "frames_to_first_false_track": np.where(np.isinf(self._first_injected), np.nan, self._first_injected),
        }
