"""What the agents detect."""

from __future__ import annotations

from trust_env.compiled.kernels import kernel
from trust_env.world import origin
from trust_env.world.fov import contains, sample
from trust_env.world.random import CLUTTER_COUNT, DETECTION, key_of, normal, poisson, uniform, unit, words


@kernel
def sense(world):
    """Every agent's raw detections of the present frame, nearest first."""
    targets, inside = world.targets, world.scratch.listing
    for k in range(world.agents.role.shape[0]):
        listed, world.raw.count[k] = 0, 0
        for n in range(targets.alive.shape[0]):
            inside[listed] = n
            listed += int(targets.alive[n] & contains(world, k, targets.state[n, 0], targets.state[n, 1]))
        for i in range(listed):
            _detect(world, k, inside[i])
        _add_clutter(world, k)


@kernel
def _detect(world, k, n):
    """Detect target n with probability P_D, with noise N(0, R_k)."""
    chance, first, second, _ = words(key_of(world), DETECTION, world.clock.frame, (k << 16) | n)
    if unit(chance) < world.agents.p_detect[k]:
        state, factor = world.targets.state[n], world.agents.noise_chol[k]
        a, b = normal(first), normal(second)
        x, y = state[0] + factor[0, 0] * a, state[1] + factor[1, 0] * a + factor[1, 1] * b
        _list_detection(world, k, x, y, n)


@kernel
def _add_clutter(world, k):
    """Natural false positives: Poisson in number, uniform in the FOV."""
    mean, key, frame = world.agents.clutter_mean[k], key_of(world), world.clock.frame
    if mean > 0.0:
        for index in range(poisson(mean, uniform(key, CLUTTER_COUNT, frame, k))):
            x, y = sample(world, k, key, frame, (k << 12) | index)
            _list_detection(world, k, x, y, origin.CLUTTER)


@kernel
def _list_detection(world, k, x, y, source):
    """Insert a detection into the agent's list, which is kept by distance; the farthest gives way when the
    list is full.
    """
    raw, pose, rank = world.raw, world.agents.pose[k], world.scratch.rank
    points, origins, capacity = raw.detections[k], raw.origin[k], rank.shape[0]
    distance2 = (x - pose[0]) ** 2 + (y - pose[1]) ** 2
    if raw.count[k] == capacity:
        world.overflow.detections += 1
        if distance2 >= rank[capacity - 1]:
            return
        raw.count[k] -= 1
    d = raw.count[k]
    while d > 0 and rank[d - 1] > distance2:
        rank[d], origins[d] = rank[d - 1], origins[d - 1]
        points[d, 0], points[d, 1] = points[d - 1, 0], points[d - 1, 1]
        d -= 1
    rank[d], points[d, 0], points[d, 1], origins[d] = distance2, x, y, source
    raw.count[k] += 1
