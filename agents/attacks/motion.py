"""How phantoms move: one frame on, within the zone in which they may stand."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from trust_env.scenario import Scenario

MOTIONS = ("static", "constant_velocity", "random_walk", "pace")
# Whether points [w, ..., 2] lie in the zones of their phantoms, in the worlds `rows`.
Contains = Callable[[np.ndarray, np.ndarray | slice], np.ndarray]
Turns = Callable[[np.ndarray | slice], np.ndarray]  # U[0, 1) draws [w, ...] for the worlds `rows`
_ALL = slice(None)


def step(
    motion: str, position: np.ndarray, velocity: np.ndarray, turns: Turns, dt: float, contains: Contains
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions [W, ..., 2] (m), velocities [W, ..., 2] (m/s) after `dt` (s), and bool[W, ...]: which have left their
    zone.

    constant_velocity: straight on, out of the zone too | random_walk: a new direction in every frame, and none
    out of the zone | pace: straight on, and at the edge back into the zone.
    """
    if motion == "random_walk":
        velocity = rotated(velocity, turns(_ALL))
    moved = position + dt * velocity
    inside = contains(moved, _ALL)
    if motion == "constant_velocity":
        return moved, velocity, ~inside
    if motion == "pace" and not inside.all():
        rows = np.flatnonzero(~inside.reshape(len(inside), -1).all(axis=1))
        velocity = velocity.copy()
        velocity[rows], inside[rows] = _turn_back(
            position[rows], velocity[rows], inside[rows], turns(rows), dt, lambda points: contains(points, rows)
        )
        moved[rows] = position[rows] + dt * velocity[rows]
    return np.where(inside[..., None], moved, position), velocity, np.zeros_like(inside)


def _turn_back(
    position: np.ndarray,
    velocity: np.ndarray,
    inside: np.ndarray,
    turns: np.ndarray,
    dt: float,
    contains: Callable[[np.ndarray], np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Velocities, and whether they lead to a place inside: of those for which it is not `inside` already the way back
    at an angle of up to 90 degrees, else straight back.
    """
    aslant = rotated(-velocity, 0.5 * turns - 0.25, keep_heading=True)
    fits = contains(position + dt * aslant)
    back = np.where(fits[..., None], aslant, -velocity)
    velocity = np.where(inside[..., None], velocity, back)
    stays = inside | fits
    return velocity, stays if stays.all() else contains(position + dt * velocity)


def rotated(velocity: np.ndarray, turns: np.ndarray, keep_heading: bool = False) -> np.ndarray:
    """Velocities [..., 2] of the same length, turned by `turns` (fractions of a full turn) from the x axis, or
    from where they pointed.
    """
    # Contiguous, as the functions of NumPy may give other bits for other strides.
    x, y = np.ascontiguousarray(velocity[..., 0]), np.ascontiguousarray(velocity[..., 1])
    angle = 2.0 * np.pi * np.ascontiguousarray(turns)
    c, s = np.cos(angle), np.sin(angle)
    if keep_heading:
        return np.stack([c * x - s * y, s * x + c * y], axis=-1)
    length = np.hypot(x, y)
    return np.stack([length * c, length * s], axis=-1)


def drawn_velocities(draws: np.ndarray, speeds: tuple[float, float]) -> np.ndarray:
    """Velocities [..., 2] (m/s) of uniform speed and direction, from U[0, 1) draws[..., 2]."""
    slow, fast = speeds
    speed = slow + np.ascontiguousarray(draws[..., 0]) * (fast - slow)
    east = np.stack([speed, np.zeros_like(speed)], axis=-1)
    return rotated(east, draws[..., 1])


def target_speeds(scenario: Scenario) -> tuple[float, float]:
    """Slowest and fastest, m/s; over a recording both are the tracker's initial velocity deviation."""
    if scenario.targets.data is None:
        return scenario.targets.speed
    deviation = math.sqrt(scenario.tracker.initial_velocity_variance)
    return deviation, deviation
