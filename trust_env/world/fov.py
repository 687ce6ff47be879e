"""Fields of view Φ_k: circle, sector, convex polygon. All angles in radians, all lengths in metres.

Sectors have their apex at the agent and open `width` around `pose heading + fov heading`; polygons are given
in the agent's frame and turn with it.
"""

from __future__ import annotations

import math

import numpy as np

from trust_env.compiled.kernels import inlined, kernel
from trust_env.world.random import CLUTTER, uniform_pair

CIRCLE, SECTOR, POLYGON = 0, 1, 2
CODES = {"circle": CIRCLE, "sector": SECTOR, "polygon": POLYGON}
_INSIDE = 1.0 - 1e-6  # a point moved inside must be inside for everyone, whatever the rounding


@kernel
def _wrap(angle):
    """An angle in (-π, π]."""
    return math.pi - (math.pi - angle) % (2.0 * math.pi)


@kernel
def _local(pose, x, y):
    """A point in the agent's own frame."""
    dx, dy = x - pose[0], y - pose[1]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return c * dx + s * dy, -s * dx + c * dy


@kernel
def _global(pose, x, y):
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return pose[0] + c * x - s * y, pose[1] + s * x + c * y


@inlined
def contains(world, k, x, y):
    """Φ_k(x, y)."""
    agents = world.agents
    dx, dy, radius = x - agents.pose[k, 0], y - agents.pose[k, 1], agents.fov_radius[k]
    near = dx * dx + dy * dy <= radius * radius
    if agents.fov_type[k] == CIRCLE:
        return near
    return near and _in_shape(world, k, x, y)


@inlined
def within_reach(world, k, x, y, reach):
    """Whether a point lies within `reach` of agent k."""
    pose = world.agents.pose
    dx, dy = x - pose[k, 0], y - pose[k, 1]
    return dx * dx + dy * dy <= reach * reach


@kernel
def _in_shape(world, k, x, y):
    """Whether a point within the radius lies in a sector or polygon."""
    pose = world.agents.pose[k]
    if world.agents.fov_type[k] == SECTOR:
        dx, dy, half = x - pose[0], y - pose[1], world.agents.fov_half_width[k]
        if half >= math.pi or (dx == 0.0 and dy == 0.0):
            return True
        return abs(_wrap(math.atan2(dy, dx) - pose[2] - world.agents.fov_heading[k])) <= half
    u, v = _local(pose, x, y)
    return _in_polygon(world.agents.fov_vertices[k], world.agents.fov_sides[k], u, v)


@kernel
def _in_polygon(vertices, sides, u, v):
    """Whether a point lies in a convex polygon whose vertices run counterclockwise."""
    for a in range(sides):
        b = a + 1 if a + 1 < sides else 0
        ex, ey = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1]
        if ex * (v - vertices[a, 1]) - ey * (u - vertices[a, 0]) < 0.0:
            return False
    return True


@kernel
def move_inside(world, k, x, y):
    """The point itself if Φ_k holds it, else one just inside Φ_k."""
    if contains(world, k, x, y):
        return x, y
    pose = world.agents.pose[k]
    kind = world.agents.fov_type[k]
    if kind == POLYGON:
        u, v = _local(pose, x, y)
        u, v = _toward_centroid(world.agents.fov_vertices[k], world.agents.fov_sides[k], u, v)
        return _global(pose, u, v)
    radius = world.agents.fov_radius[k]
    dx, dy = x - pose[0], y - pose[1]
    distance, angle = math.hypot(dx, dy), math.atan2(dy, dx)
    distance = min(distance, radius * _INSIDE)
    if kind == SECTOR:
        axis, half = pose[2] + world.agents.fov_heading[k], world.agents.fov_half_width[k]
        off = _wrap(angle - axis)
        if half < math.pi:
            off = max(-half * _INSIDE, min(half * _INSIDE, off))
        angle = axis + off
    return pose[0] + distance * math.cos(angle), pose[1] + distance * math.sin(angle)


@kernel
def _toward_centroid(vertices, sides, u, v):
    """The point of the segment to the centroid where it enters the polygon, a little further in."""
    cu, cv = 0.0, 0.0
    for a in range(sides):
        cu += vertices[a, 0] / sides
        cv += vertices[a, 1] / sides
    share = 1.0
    for a in range(sides):
        b = a + 1 if a + 1 < sides else 0
        ex, ey = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1]
        outside = ex * (v - vertices[a, 1]) - ey * (u - vertices[a, 0])
        if outside < 0.0:
            centre = ex * (cv - vertices[a, 1]) - ey * (cu - vertices[a, 0])
            share = min(share, centre / (centre - outside))
    share *= _INSIDE
    return cu + share * (u - cu), cv + share * (v - cv)


@kernel
def bounding_box(world, k):
    """`x_min, x_max, y_min, y_max` of Φ_k, in metres: the square to which actions are scaled."""
    pose = world.agents.pose[k]
    radius = world.agents.fov_radius[k]
    kind = world.agents.fov_type[k]
    if kind == CIRCLE:
        return pose[0] - radius, pose[0] + radius, pose[1] - radius, pose[1] + radius
    x0, x1, y0, y1 = np.inf, -np.inf, np.inf, -np.inf
    if kind == POLYGON:
        vertices = world.agents.fov_vertices[k]
        for a in range(world.agents.fov_sides[k]):
            x, y = _global(pose, vertices[a, 0], vertices[a, 1])
            x0, x1, y0, y1 = min(x0, x), max(x1, x), min(y0, y), max(y1, y)
        return x0, x1, y0, y1
    axis, half = pose[2] + world.agents.fov_heading[k], world.agents.fov_half_width[k]
    x0, x1, y0, y1 = pose[0], pose[0], pose[1], pose[1]
    for corner in range(6):  # both edges of the sector, and those of the four compass points that it holds
        angle = axis + (half if corner == 0 else -half)
        if corner >= 2:
            angle = (corner - 2) * 0.5 * math.pi
        if corner < 2 or abs(_wrap(angle - axis)) <= half:
            x, y = pose[0] + radius * math.cos(angle), pose[1] + radius * math.sin(angle)
            x0, x1, y0, y1 = min(x0, x), max(x1, x), min(y0, y), max(y1, y)
    return x0, x1, y0, y1


@kernel
def sample(world, k, key, frame, index):
    """A point uniform in Φ_k (a clutter detection), from draw `index` of the agent's clutter stream."""
    pose = world.agents.pose[k]
    radius = world.agents.fov_radius[k]
    kind = world.agents.fov_type[k]
    if kind == POLYGON:
        x0, x1, y0, y1 = bounding_box(world, k)
        # A triangle fills half its box at least, unless it is turned: then an eighth or so.
        for attempt in range(64):
            u, v = uniform_pair(key, CLUTTER, frame, (index << 6) | attempt)
            x, y = x0 + u * (x1 - x0), y0 + v * (y1 - y0)
            if contains(world, k, x, y):
                return x, y
        return move_inside(world, k, x, y)  # pyright: ignore[reportPossiblyUnboundVariable]
    u, v = uniform_pair(key, CLUTTER, frame, index << 6)
    distance = radius * math.sqrt(u)
    half = math.pi if kind == CIRCLE else world.agents.fov_half_width[k]
    centre = 0.0 if kind == CIRCLE else pose[2] + world.agents.fov_heading[k]
    angle = centre + (2.0 * v - 1.0) * half
    return pose[0] + distance * math.cos(angle), pose[1] + distance * math.sin(angle)
