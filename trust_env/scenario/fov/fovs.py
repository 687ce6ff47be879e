"""Fields of view Φ_k of several agents as NumPy functions: what poses and the scenario alone tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trust_env.scenario.fov.shape import FovGroup, FovShape, to_global, to_local
from trust_env.scenario.scenario import Scenario

Members = np.ndarray | slice  # which of the n agents


@dataclass(frozen=True)
class Fovs:
    """The FOVs of n agents, grouped by shape; each shape works in its agents' frames (x ahead, y left)."""

    middle: np.ndarray  # float[n, 2], m, a point well inside
    groups: tuple[tuple[Members, FovGroup], ...]

    @classmethod
    def of(cls, scenario: Scenario, agents: np.ndarray) -> Fovs:
        """The FOVs of the given agents."""
        shapes = [scenario.agent(int(k)).fov.shape for k in agents]
        middle = np.array([shape.middle for shape in shapes]).reshape(-1, 2)
        return cls(middle, tuple(_by_shape(shapes)))

    def contains(self, pose: np.ndarray, points: np.ndarray, margin: float = 0.0) -> np.ndarray:
        """Φ(points), bool[..., n, P], for pose[..., n, 4] and points[..., n, P, 2] (n may be 1: for all).

        With a margin, whether a point stays inside when it moves away from the middle by that fraction of its
        distance.
        """
        u, v = to_local(pose, points)
        if margin:
            middle = self.middle[:, None, :]
            u, v = u + margin * (u - middle[..., 0]), v + margin * (v - middle[..., 1])
        inside = np.empty(u.shape, dtype=bool)
        for members, group in self.groups:
            inside[..., members, :] = group.contains(u[..., members, :], v[..., members, :])
        return inside

    def boxes(self, pose: np.ndarray) -> np.ndarray:
        """x_min, x_max, y_min, y_max (m) [..., n, 4] for pose[..., n, 4]: what actions are scaled to."""
        boxes = np.empty((*pose.shape[:-1], 4))
        for members, group in self.groups:
            boxes[..., members, :] = group.boxes(pose[..., members, :])
        return boxes

    def middles(self, pose: np.ndarray) -> np.ndarray:
        """A point well inside each FOV, [..., n, 2] (m) in the world, for pose[..., n, 4]."""
        x, y = to_global(pose, self.middle[:, :1], self.middle[:, 1:])
        return np.stack([x[..., 0], y[..., 0]], axis=-1)

    def sample(self, pose: np.ndarray, draws: np.ndarray) -> np.ndarray:
        """Points uniform in the FOVs: [..., n, P, 2] (m), from U[0, 1) draws[..., n, P, 3]."""
        u, v = np.empty(draws.shape[:-1]), np.empty(draws.shape[:-1])
        for members, group in self.groups:
            u[..., members, :], v[..., members, :] = group.sample(draws[..., members, :, :])
        return np.stack(to_global(pose, u, v), axis=-1)


def _by_shape(shapes: list[FovShape]) -> list[tuple[Members, FovGroup]]:
    """The groups of equal shape, each with the indices of its members."""
    kinds = list(dict.fromkeys(type(shape) for shape in shapes))
    if len(kinds) == 1:  # views instead of copies
        return [(slice(None), kinds[0].group(shapes))]
    members = [np.array([i for i, shape in enumerate(shapes) if type(shape) is kind]) for kind in kinds]
    return [(m, kind.group([shapes[i] for i in m])) for kind, m in zip(kinds, members)]
