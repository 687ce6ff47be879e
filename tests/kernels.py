"""One world on which tests run single kernels, and what they compare with."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from oracle import Contains, circle, polygon, sector

from trust_env.batch import Batch
from trust_env.compiled.kernels import kernel
from trust_env.compiled.layout import PARAMETERS, SCRATCH
from trust_env.compiled.mode import INTERPRETED, OPTIONS
from trust_env.compiled.structs import World, world_at
from trust_env.scenario import Scenario


class Bench:
    """A world whose memory tests read and write by field name; kernels run on `bench.world`."""

    def __init__(self, scenario: Any = "patrol", defense: Any = "score"):
        self.worlds = Batch(scenario, defense, 1)
        self.scenario, parameters = self.worlds.scenario, self.worlds.parameters
        self._buffers = {PARAMETERS: parameters.buffer, SCRATCH: self.worlds.scratch[0]}
        actions, table = self.worlds.arrays.action, parameters.layout.table
        buffers = (self.worlds.rows, parameters.buffer, self.worlds.scratch, actions, table)
        self.world = World(*(buffer.ctypes.data for buffer in buffers))

    def __getitem__(self, name: str) -> np.ndarray:
        layout = self.worlds.parameters.layout
        buffer = self._buffers.get(layout.fields[name].buffer)
        return self.worlds.arrays[name][0] if buffer is None else layout.view(buffer, name)


def entry(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function for kernels that Python can call, too, with `bench.world` where it takes a world (a decorator)."""
    if INTERPRETED:
        return function
    called = kernel(function)
    if next(iter(inspect.signature(function).parameters)) != "world":
        return numba.njit(**OPTIONS)(lambda *args: called(*args))

    @numba.njit(**OPTIONS)
    def call(row, parameters, scratch, actions, layout, *args):
        return called(world_at(row, parameters, scratch, actions, layout), *args)

    return lambda world, *args: call(*world, *args)


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
