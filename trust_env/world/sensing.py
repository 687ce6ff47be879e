"""What the agents detect, and where they stand."""

from __future__ import annotations

import math

from trust_env.compiled.jit import compiled
from trust_env.world.fields import (
    F,
    flags1,
    floats1,
    floats2,
    floats3,
    ints1,
    ints2,
    real,
    shape0,
    shape1,
    whole,
)
from trust_env.world.fov import bounding_box, contains, sample
from trust_env.world.random import (
    CLUTTER_COUNT,
    DETECTION,
    PLACEMENT,
    key_of,
    normal,
    poisson,
    uniform,
    uniform_pair,
    unit,
    words,
)

CLUTTER_ORIGIN = -1  # `raw_origin` of a natural false positive; a target's is its index
FULL_DETECTIONS, FULL_INJECTIONS, EVICTED_TRACKS, DROPPED_BIRTHS = (
    0,
    1,
    2,
    3,
)  # `overflow`: what did not fit, counted

PLACED_RANDOM, PLACED_OVERLAPPING = 0, 1


@compiled
def place_agents(world):
    """Poses of the episode: as the scenario gives them, or drawn."""
    pose, start, drawn = floats2(world, F.pose), floats2(world, F.start_pose), flags1(world, F.pose_drawn)
    area, key = floats1(world, F.area), key_of(world)
    for k in range(pose.shape[0]):
        for axis in range(3):
            pose[k, axis] = start[k, axis]
        if drawn[k]:
            u, v = uniform_pair(key, PLACEMENT, 0, 2 * k)
            if whole(world, F.placement) == PLACED_OVERLAPPING:
                radius = real(world, F.spread) * math.sqrt(u)
                pose[k, 0] = 0.5 * (area[0] + area[1]) + radius * math.cos(2.0 * math.pi * v)
                pose[k, 1] = 0.5 * (area[2] + area[3]) + radius * math.sin(2.0 * math.pi * v)
            else:
                pose[k, 0], pose[k, 1] = area[0] + u * (area[1] - area[0]), area[2] + v * (area[3] - area[2])
            pose[k, 2] = 2.0 * math.pi * uniform(key, PLACEMENT, 0, 2 * k + 1) - math.pi
    locate_fovs(world)


@compiled
def locate_fovs(world):
    """Bounding boxes of all FOVs, from the poses."""
    box = floats2(world, F.fov_box)
    for k in range(box.shape[0]):
        box[k, 0], box[k, 1], box[k, 2], box[k, 3] = bounding_box(world, k)


@compiled
def sense(world, frame):
    """Every agent's raw detections of a frame, nearest first."""
    key = key_of(world)
    alive, state = flags1(world, F.target_alive), floats2(world, F.target_state)
    inside = ints1(world, F.listing)
    for k in range(shape0(world, F.pose)):
        listed, ints1(world, F.raw_count)[k] = 0, 0
        for n in range(alive.shape[0]):
            inside[listed] = n
            listed += int(alive[n] & contains(world, k, state[n, 0], state[n, 1]))
        for i in range(listed):
            _detect(world, key, frame, k, inside[i])
        _add_clutter(world, key, frame, k)


@compiled
def _detect(world, key, frame, k, n):
    """Detect target n with probability P_D, with noise N(0, R_k)."""
    chance, first, second, _ = words(key, DETECTION, frame, (k << 16) | n)
    if unit(chance) < floats1(world, F.p_detect)[k]:
        state, factor = floats2(world, F.target_state), floats3(world, F.noise_chol)[k]
        a, b = normal(first), normal(second)
        _list_detection(
            world, k, state[n, 0] + factor[0, 0] * a, state[n, 1] + factor[1, 0] * a + factor[1, 1] * b, n
        )


@compiled
def _add_clutter(world, key, frame, k):
    """Natural false positives: Poisson in number, uniform in the FOV."""
    mean = floats1(world, F.clutter_mean)[k]
    if mean > 0.0:
        for index in range(poisson(mean, uniform(key, CLUTTER_COUNT, frame, k))):
            x, y = sample(world, k, key, frame, (k << 12) | index)
            _list_detection(world, k, x, y, CLUTTER_ORIGIN)


@compiled
def _list_detection(world, k, x, y, origin):
    """Insert a detection into the agent's list, which is kept by distance; the farthest gives way when the
    list is full.
    """
    count, capacity = ints1(world, F.raw_count), shape1(world, F.raw_detections)
    points, origins, pose = (
        floats3(world, F.raw_detections)[k],
        ints2(world, F.raw_origin)[k],
        floats2(world, F.pose)[k],
    )
    rank = floats1(world, F.rank)  # squared distances of the list
    distance = (x - pose[0]) ** 2 + (y - pose[1]) ** 2
    if count[k] == capacity:
        ints1(world, F.overflow)[FULL_DETECTIONS] += 1
        if distance >= rank[capacity - 1]:
            return
        count[k] -= 1
    d = count[k]
    while d > 0 and rank[d - 1] > distance:
        rank[d], points[d, 0], points[d, 1], origins[d] = (
            rank[d - 1],
            points[d - 1, 0],
            points[d - 1, 1],
            origins[d - 1],
        )
        d -= 1
    rank[d], points[d, 0], points[d, 1], origins[d] = distance, x, y, origin
    count[k] += 1
