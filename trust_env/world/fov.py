"""Fields of view Φ_k where the agents stand; what their shapes are is said in `trust_env.scenario.fov`."""

from __future__ import annotations

import math

from trust_env.compiled.kernels import choose, inlined, kernel
from trust_env.scenario.fov import SHAPES
from trust_env.world.random import CLUTTER, uniform_pair

_SHAPES = SHAPES.values()
_holds = choose([shape.holds for shape in _SHAPES], "fov", "frame", "x", "y")
_nearest_inside = choose([shape.nearest_inside for shape in _SHAPES], "fov", "reach", "frame", "x", "y")
_box = choose([shape.box for shape in _SHAPES], "fov", "reach", "frame")
_edge = choose([shape.edge for shape in _SHAPES], "fov", "reach", "frame", "x", "y")
_candidate = choose([shape.candidate for shape in _SHAPES], "fov", "reach", "frame", "first", "second")
_ATTEMPTS = 64  # at a point of an FOV; 6 bits of a draw's index count them


@kernel
def locate_fovs(world):
    """Where the FOVs look, and the boxes around them, from the agents' poses."""
    agents = world.agents
    for k in range(agents.pose.shape[0]):
        frame, box, heading = agents.fov_frame[k], agents.fov_box[k], agents.pose[k, 2] + agents.fov_heading[k]
        frame[0], frame[1], frame[2] = agents.pose[k, 0], agents.pose[k, 1], heading
        frame[3], frame[4] = math.cos(heading), math.sin(heading)
        x0, x1, y0, y1 = _box(agents.fov_shape[k], agents.fov_numbers[k], agents.fov_radius[k], frame)
        box[0], box[1], box[2], box[3] = x0, x1, y0, y1


@inlined
def contains(world, k, x, y):
    """Φ_k(x, y)."""
    agents = world.agents
    dx, dy, radius = x - agents.pose[k, 0], y - agents.pose[k, 1], agents.fov_radius[k]
    near = dx * dx + dy * dy <= radius * radius
    if agents.fov_is_round[k]:
        return near
    return near and _holds(agents.fov_shape[k], agents.fov_numbers[k], agents.fov_frame[k], x, y)


@kernel
def probability_inside(world, k, x, y, xx, xy, yy):
    """P(Φ_k) of a point N([x, y], [[xx, xy], [xy, yy]]), the FOV's edge taken as straight where it is nearest.

    Φ(m / σ), m the distance to the edge, positive inside, and σ² = nᵀPn along its normal n.
    """
    agents = world.agents
    fov, reach, frame = agents.fov_numbers[k], agents.fov_radius[k], agents.fov_frame[k]
    margin, nx, ny = _edge(agents.fov_shape[k], fov, reach, frame, x, y)
    variance = nx * nx * xx + 2.0 * nx * ny * xy + ny * ny * yy
    return 0.5 * math.erfc(-margin / math.sqrt(2.0 * variance))


@inlined
def within_reach(world, k, x, y, reach):
    """Whether a point lies within `reach` of agent k."""
    pose = world.agents.pose
    dx, dy = x - pose[k, 0], y - pose[k, 1]
    return dx * dx + dy * dy <= reach * reach


@kernel
def move_inside(world, k, x, y):
    """The point itself if Φ_k holds it, else one just inside Φ_k."""
    if contains(world, k, x, y):
        return x, y
    agents = world.agents
    fov, reach, frame = agents.fov_numbers[k], agents.fov_radius[k], agents.fov_frame[k]
    return _nearest_inside(agents.fov_shape[k], fov, reach, frame, x, y)


@kernel
def sample(world, k, key, frame, index):
    """A point uniform in Φ_k (a clutter detection), from draw `index` of the agent's clutter stream."""
    agents, x, y = world.agents, 0.0, 0.0
    shape, fov, reach = agents.fov_shape[k], agents.fov_numbers[k], agents.fov_radius[k]
    for attempt in range(_ATTEMPTS):
        first, second = uniform_pair(key, CLUTTER, frame, (index << 6) | attempt)
        x, y = _candidate(shape, fov, reach, agents.fov_frame[k], first, second)
        if agents.fov_is_round[k] or _holds(shape, fov, agents.fov_frame[k], x, y):
            return x, y
    return move_inside(world, k, x, y)
