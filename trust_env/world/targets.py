"""Targets: constant velocity with process noise, births and deaths; fixed starts; or recorded trajectories.

Every target slot draws from streams of its own, so that adding a slot changes nobody else's path.
"""

from __future__ import annotations

import math

from trust_env.compiled.jit import compiled
from trust_env.world.fields import F, flags1, floats1, floats2, floats3, real, shape0, whole
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

DRAWN, FIXED, RECORDED = 0, 1, 2


@compiled
def place_targets(world):
    """Put every target where the episode starts (frame 0)."""
    alive, state = flags1(world, F.target_alive), floats2(world, F.target_state)  # [N], [N, 4]
    start = floats2(world, F.start_state)  # [N, 4]
    key, source = key_of(world), whole(world, F.target_source)
    for n in range(alive.shape[0]):
        if source == RECORDED:
            _follow_record(world, n, 0)
        elif source == FIXED:
            alive[n] = True
            for axis in range(4):
                state[n, axis] = start[n, axis]
            if math.isnan(start[n, 2]):  # the scenario gives no velocities
                _draw_velocity(world, key, 0, n)
        else:
            alive[n] = uniform(key, TARGET_LIFE, 0, n) < real(world, F.initial_probability)
            _draw_start(world, key, 0, n)


@compiled
def _draw_start(world, key, frame, n):
    """A uniform position in the area, a uniform heading, a uniform speed."""
    area, state = floats1(world, F.area), floats2(world, F.target_state)
    u, v = uniform_pair(key, TARGET_START, frame, 2 * n)
    state[n, 0], state[n, 1] = area[0] + u * (area[1] - area[0]), area[2] + v * (area[3] - area[2])
    _draw_velocity(world, key, frame, n)


@compiled
def _draw_velocity(world, key, frame, n):
    state, speed = floats2(world, F.target_state), floats1(world, F.speed)
    u, v = uniform_pair(key, TARGET_START, frame, 2 * n + 1)
    rate = speed[0] + u * (speed[1] - speed[0])
    state[n, 2], state[n, 3] = rate * math.cos(2.0 * math.pi * v), rate * math.sin(2.0 * math.pi * v)


@compiled
def _follow_record(world, n, frame):
    """Target n as recorded in a frame; absent (NaN) where the recording has a gap."""
    record = floats3(world, F.record)  # [T, N, 4]
    alive, state = flags1(world, F.target_alive), floats2(world, F.target_state)
    alive[n] = frame < record.shape[0] and not math.isnan(record[min(frame, record.shape[0] - 1), n, 0])
    for axis in range(4):
        state[n, axis] = record[frame, n, axis] if alive[n] else 0.0


@compiled
def move_targets(world, frame):
    """Step 5 of a frame: targets move, leave and are born; `frame` is the one that begins."""
    source = whole(world, F.target_source)
    for n in range(shape0(world, F.target_alive)):
        if source == RECORDED:
            _follow_record(world, n, frame)
        elif source == FIXED:
            _drift(world, key_of(world), frame, n)
        else:
            _live(world, frame, n)


@compiled
def _live(world, frame, n):
    alive, state, area = flags1(world, F.target_alive), floats2(world, F.target_state), floats1(world, F.area)
    key = key_of(world)
    u = uniform(key, TARGET_LIFE, frame, n)
    if not alive[n]:
        if u < real(world, F.birth_rate):
            alive[n] = True
            _draw_start(world, key, frame, n)
        return
    _drift(world, key, frame, n)
    inside = area[0] <= state[n, 0] <= area[1] and area[2] <= state[n, 1] <= area[3]
    alive[n] = inside and u >= real(world, F.death_rate)


@compiled
def _drift(world, key, frame, n):
    """Constant velocity with white-noise acceleration of density q (Bar-Shalom, Li & Kirubarajan 2001, Sec.
    6.2.2).
    """
    state, dt, q = floats2(world, F.target_state), real(world, F.dt), real(world, F.target_noise)
    for axis in range(2):
        state[n, axis] += dt * state[n, 2 + axis]
    if q > 0.0:
        push, slip = math.sqrt(q * dt), math.sqrt(q * dt * dt * dt / 12.0)
        w0, w1, w2, w3 = words(key, TARGET_MOTION, frame, n)
        for axis in range(2):
            kick = push * normal(w0 if axis == 0 else w2)
            state[n, axis] += 0.5 * dt * kick + slip * normal(w1 if axis == 0 else w3)
            state[n, 2 + axis] += kick
