"""What discrete wrappers suppress of a learner's own detections: none, the nearer ones, the farther ones, or all."""

from __future__ import annotations

import numpy as np

from trust_env.agents.wrappers.reference_frame import Points
from trust_env.spaces.observation import REACH

NONE, NEAR, FAR, ALL = range(4)
CHOICES = ALL + 1
NEARER_HALF = np.sqrt(0.5) / REACH  # distance in REACH radii: half of a circle's area lies within


def suppressed(choice: np.ndarray, detections: Points) -> np.ndarray:
    """Which detections[W, n, D] (relative to the learner, REACH radii) are suppressed by choice[W, n, 1], bool."""
    near = np.abs(detections) < NEARER_HALF
    return (choice == ALL) | np.where(near, choice == NEAR, choice == FAR)
