"""What a sensor cannot tell apart: detections of one agent that are nearer than its resolution are one."""

from __future__ import annotations

from trust_env.compiled.kernels import inlined, kernel


@kernel
def merge_unresolved(world):
    """Keep of detections that an agent cannot resolve the first, as it is: honest ones in list order, the nearest
    first, then injections by slot. A detection nearer than the resolution to one that is kept is dropped.
    """
    for k in range(world.reports.count.shape[0]):
        if world.agents.resolution[k] > 0.0:
            world.reports.count[k] = _keep_resolved(world, k)


@kernel
def _keep_resolved(world, k):
    """Move the detections that are kept to the front of the agent's report; returns how many."""
    points, origin, kept = world.reports.detections[k], world.reports.origin[k], 0
    for d in range(world.reports.count[k]):
        if _is_apart(points, kept, points[d, 0], points[d, 1], world.agents.resolution[k]):
            points[kept, 0], points[kept, 1], origin[kept] = points[d, 0], points[d, 1], origin[d]
            kept += 1
    return kept


@inlined
def _is_apart(points, count, x, y, resolution):
    """Whether a point is at least `resolution` (m) from the first `count` points."""
    apart = True
    for d in range(count):
        dx, dy = points[d, 0] - x, points[d, 1] - y
        apart &= dx * dx + dy * dy >= resolution * resolution
    return apart
