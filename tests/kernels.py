"""One world on which tests run single kernels, and what they compare with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from oracle import Contains, circle, polygon, sector
from trust_env.compiled.jit import Entry

from trust_env.batch import Batch
from trust_env.scenario import Scenario
from trust_env.world.fields import PARAMS, ROW, World


class Bench:
    """A world whose memory tests read and write by field name; kernels run on `bench.world`."""

    def __init__(self, scenario: Any = "patrol", defense: Any = "score"):
        self.worlds = Batch(scenario, defense, 1)
        self.scenario = self.worlds.scenario
        addresses = (
            self.worlds.rows,
            self.worlds.pack.params,
            self.worlds.crew.scratch,
            self.worlds.pack.layout.table,
        )
        self.world = World(*(np.int64(buffer.ctypes.data) for buffer in addresses))

    def __getitem__(self, name: str) -> np.ndarray:
        layout = self.worlds.pack.layout
        kind = layout.kinds[name][0]
        buffers = {ROW: self.worlds.rows[0], PARAMS: self.worlds.pack.params}
        return layout.view(buffers.get(kind, self.worlds.crew.scratch[0]), name)


def entry(kernel: Callable[..., Any]) -> Entry:
    """A kernel that Python can call (also as a decorator)."""
    return Entry(kernel)


def fov_of(scenario: Scenario, k: int, pose: np.ndarray) -> Contains:
    """Φ_k from the scenario and the agent's pose `[3]`, by the plain functions of the reference."""
    fov = scenario.agent(k).fov
    x, y, heading = (float(value) for value in pose)
    if fov.type == "circle":
        return circle((x, y), fov.radius)
    if fov.type == "sector":
        return sector((x, y), fov.radius, heading + fov.heading, fov.width)
    turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
    return polygon(np.array(fov.vertices) @ turn.T + (x, y))


def reach_of(scenario: Scenario, k: int) -> float:
    """Distance of the FOV's farthest point from the agent, m."""
    fov = scenario.agent(k).fov
    corners = np.array(fov.vertices) if fov.vertices is not None else np.zeros((1, 2))
    return float(np.hypot(*corners.T).max()) if fov.type == "polygon" else fov.radius
