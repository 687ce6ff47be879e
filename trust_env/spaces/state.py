"""The global state, as `state()` gives it to centralised critics: the truth, all tracks, all agents."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from trust_env.spaces.observation import SCORE_SCALE, Scales


class StateTable:
    """Fields of the state by name: `slices[name]`, `shapes[name]`; `size` entries of float32 in [-1, 1].

    targets[N, 5]: alive, x, y, vx, vy; tracks[J, 7]: x, y, vx, vy, status / 2, score / 50, trust (-1: no
    opinion); agents[K, 6]: role, x, y, cos and sin of the heading, trust (-1: no opinion); time: frame /
    horizon. Scaled as observations are.
    """

    def __init__(self, lengths: Mapping[str, int], scales: Scales, roles: np.ndarray, horizon: int):
        self._scales, self._roles, self._horizon = scales, roles, horizon
        n, j, k = lengths["N"], lengths["J"], lengths["K"]
        self.shapes = {"targets": (n, 5), "tracks": (j, 7), "agents": (k, 6), "time": (1,)}
        self.slices, self.size = dict[str, slice](), 0
        for name, shape in self.shapes.items():
            self.slices[name] = slice(self.size, self.size + math.prod(shape))
            self.size += math.prod(shape)

    def read(self, arrays: Any, w: int) -> np.ndarray:
        """The state of world w of the worlds' arrays."""
        a, scales = arrays, self._scales
        out = np.zeros(self.size)
        parts = {name: out[self.slices[name]].reshape(shape) for name, shape in self.shapes.items()}
        alive, tracked = a.target_alive[w], a.track_status[w] > 0
        parts["targets"][alive, 0] = 1.0
        parts["targets"][alive, 1:3] = (a.target_state[w, alive, :2] - scales.centre) / scales.half
        parts["targets"][alive, 3:] = a.target_state[w, alive, 2:] / scales.speed
        parts["tracks"][tracked, :2] = (a.track_mean[w, tracked, :2] - scales.centre) / scales.half
        parts["tracks"][tracked, 2:4] = a.track_mean[w, tracked, 2:] / scales.speed
        parts["tracks"][tracked, 4] = a.track_status[w, tracked] / 2
        parts["tracks"][tracked, 5] = a.track_score[w, tracked] / SCORE_SCALE
        parts["tracks"][tracked, 6] = np.nan_to_num(a.track_trust[w, tracked], nan=-1.0)
        parts["agents"][:, 0] = self._roles
        parts["agents"][:, 1:3] = (a.pose[w, :, :2] - scales.centre) / scales.half
        parts["agents"][:, 3], parts["agents"][:, 4] = np.cos(a.pose[w, :, 2]), np.sin(a.pose[w, :, 2])
        parts["agents"][:, 5] = np.nan_to_num(a.agent_trust[w], nan=-1.0)
        parts["time"][0] = a.frame[w] / self._horizon
        return np.clip(out, -1.0, 1.0).astype(np.float32)
