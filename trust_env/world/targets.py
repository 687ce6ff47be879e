"""Targets: constant velocity with process noise, births and deaths; fixed starts; or recorded trajectories.

Every target slot draws from streams of its own, so that adding a slot changes nobody else's path.
"""

from __future__ import annotations

import math

from trust_env.compiled.kernels import kernel
from trust_env.world.random import (
    TARGET_LIFE,
    TARGET_MOTION,
    TARGET_START,
    key_of,
    normal,
    uniform,
    uniform_pair,
    words,
)

DRAWN, FIXED, RECORDED = range(3)  # `source`: where targets come from


@kernel
def place_targets(world):
    """Put every target where the episode starts (frame 0)."""
    targets, key = world.targets, key_of(world)
    for n in range(targets.alive.shape[0]):
        if targets.source == RECORDED:
            _follow_record(world, n, 0)
        elif targets.source == FIXED:
            targets.alive[n] = True
            for axis in range(4):
                targets.state[n, axis] = targets.start_state[n, axis]
            if math.isnan(targets.start_state[n, 2]):  # the scenario gives no velocities
                _draw_velocity(world, key, 0, n)
        else:
            targets.alive[n] = uniform(key, TARGET_LIFE, 0, n) < targets.initial_probability
            _draw_start(world, key, 0, n)


@kernel
def move_targets(world):
    """A new frame begins: targets move, leave and are born."""
    world.clock.frame += 1
    targets, frame = world.targets, world.clock.frame
    for n in range(targets.alive.shape[0]):
        if targets.source == RECORDED:
            _follow_record(world, n, frame)
        elif targets.source == FIXED:
            _drift(world, key_of(world), frame, n)
        else:
            _live(world, frame, n)


@kernel
def _draw_start(world, key, frame, n):
    """A uniform position in the area, a uniform heading, a uniform speed."""
    state, area = world.targets.state[n], world.targets.area
    u, v = uniform_pair(key, TARGET_START, frame, 2 * n)
    state[0], state[1] = area[0] + u * (area[1] - area[0]), area[2] + v * (area[3] - area[2])
    _draw_velocity(world, key, frame, n)


@kernel
def _draw_velocity(world, key, frame, n):
    state, speed = world.targets.state[n], world.targets.speed
    u, v = uniform_pair(key, TARGET_START, frame, 2 * n + 1)
    rate = speed[0] + u * (speed[1] - speed[0])
    state[2], state[3] = rate * math.cos(2.0 * math.pi * v), rate * math.sin(2.0 * math.pi * v)


@kernel
def _follow_record(world, n, frame):
    """Target n as recorded in a frame; absent (NaN) where the recording has a gap."""
    targets, frames = world.targets, world.targets.record.shape[0]
    there = frame < frames and not math.isnan(targets.record[min(frame, frames - 1), n, 0])
    targets.alive[n] = there
    for axis in range(4):
        targets.state[n, axis] = targets.record[frame, n, axis] if there else 0.0


@kernel
def _live(world, frame, n):
    targets, area, key = world.targets, world.targets.area, key_of(world)
    u = uniform(key, TARGET_LIFE, frame, n)
    if not targets.alive[n]:
        if u < targets.birth_rate:
            targets.alive[n] = True
            _draw_start(world, key, frame, n)
        return
    _drift(world, key, frame, n)
    x, y = targets.state[n, 0], targets.state[n, 1]
    inside = area[0] <= x <= area[1] and area[2] <= y <= area[3]
    targets.alive[n] = inside and u >= targets.death_rate


@kernel
def _drift(world, key, frame, n):
    """Constant velocity with white-noise acceleration of density q (Bar-Shalom, Li & Kirubarajan 2001, Sec.
    6.2.2).
    """
    state, dt, q = world.targets.state[n], world.clock.dt, world.targets.process_noise
    for axis in range(2):
        state[axis] += dt * state[2 + axis]
    if q > 0.0:
        velocity_std, position_std = math.sqrt(q * dt), math.sqrt(q * dt * dt * dt / 12.0)
        w0, w1, w2, w3 = words(key, TARGET_MOTION, frame, n)
        for axis in range(2):
            dv = velocity_std * normal(w0 if axis == 0 else w2)
            state[axis] += 0.5 * dt * dv + position_std * normal(w1 if axis == 0 else w3)
            state[2 + axis] += dv
