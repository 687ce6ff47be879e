"""The course of an episode: what its frames were like, one after the other."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from trust_env.metrics.forecast_scores import ratio

COURSES = ("damage", "injected", "missing", "adversary_trust", "benign_trust")
"""Of a frame: false tracks shown and missing targets together; of these, injected tracks and missing targets; the mean
trust in agents by role, NaN where there is no opinion of any.
"""


class CourseRecord:
    """Keeps `COURSES` of every frame of W worlds. is_adversary: bool[K], by role."""

    def __init__(self, is_adversary: np.ndarray):
        self._roles = (is_adversary, ~is_adversary)
        self._frames: list[np.ndarray] = []

    def update(self, values: Mapping[str, np.ndarray], trust: np.ndarray) -> None:
        """Take in a frame: its metrics by name, [W], and trust[W, K], NaN where there is no opinion."""
        known = ~np.isnan(trust)
        filled = np.where(known, trust, 0.0)
        by_role = [ratio(filled[:, role].sum(axis=1), known[:, role].sum(axis=1)) for role in self._roles]
        damage = values["false_tracks"] + values["missing_targets"]
        self._frames.append(np.stack([damage, values["injected_tracks"], values["missing_targets"], *by_role]))

    def result(self) -> dict[str, np.ndarray]:
        """Every name of `COURSES`: float64[W, T]."""
        return dict(zip(COURSES, np.stack(self._frames, axis=-1)))
