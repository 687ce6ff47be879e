"""Step 1 of a frame: each agent's action edits its own raw detections, within its budget.

`trust_env.spaces.action` says which entries of an action are injection slots [fire, x, y] and which suppress.
"""

from __future__ import annotations

from trust_env.compiled.kernels import inlined, kernel
from trust_env.world.fov import move_inside
from trust_env.world.origin import FIRST_INJECTION


@kernel
def edit_reports(world):
    """Reports of all agents: honest detections that are not suppressed, in list order, then injections by
    slot.
    """
    reports, overflow, agents = world.reports, world.overflow, world.agents
    for k in range(reports.count.shape[0]):
        injections, without_room = _count_injections(world, k), overflow.detections
        kept = _keep_honest(world, k, reports.detections.shape[1] - injections)
        suppressed = world.raw.count[k] - kept - (overflow.detections - without_room)
        if agents.first_edit[k] == 0 and injections + suppressed > 0:
            agents.first_edit[k] = world.clock.frame + 1
        reports.count[k] = _inject(world, k, kept, injections)


@inlined
def is_adversary(world, k):
    """Whether agent k counts as an adversary: its role, from its first edit on."""
    return world.agents.role[k] > 0 and world.agents.first_edit[k] > 0


@kernel
def _count_injections(world, k):
    """How many injection slots fire and fit."""
    action, capacity, fired = world.players.action[k], world.reports.detections.shape[1], 0
    for m in range(world.agents.injection_budget[k]):
        fired += action[_slot(world, m)] > 0.0
    if fired > capacity:
        world.overflow.injections += fired - capacity
        return capacity
    return fired


@inlined
def _slot(world, m):
    """The entry of an action where injection slot m begins: fire, x, y."""
    return world.players.slots_at + world.players.slot_length * m


@kernel
def _keep_honest(world, k, room):
    """Copy the detections that are not suppressed, as many as there is room for; the farthest do not fit."""
    suppress, raw, reports = world.players.action[k, world.players.suppressions_at :], world.raw, world.reports
    kept = 0
    for d in range(raw.count[k]):
        if d < world.agents.suppression_budget[k] and suppress[d] > 0.0:
            continue
        if kept == room:
            world.overflow.detections += 1
            continue
        for axis in range(2):
            reports.detections[k, kept, axis] = raw.detections[k, d, axis]
        reports.origin[k, kept] = raw.origin[k, d]
        kept += 1
    return kept


@kernel
def _inject(world, k, count, injections):
    """Append the injections that fire; actions are scaled to the FOV's bounding box, and end inside the
    FOV.
    """
    action, box, reports, left = world.players.action[k], world.agents.fov_box[k], world.reports, injections
    for m in range(world.agents.injection_budget[k]):
        fire = _slot(world, m)
        if action[fire] > 0.0 and left > 0:
            u = 0.5 + 0.5 * min(1.0, max(-1.0, action[fire + 1]))
            v = 0.5 + 0.5 * min(1.0, max(-1.0, action[fire + 2]))
            x, y = box[0] + u * (box[1] - box[0]), box[2] + v * (box[3] - box[2])
            reports.detections[k, count, 0], reports.detections[k, count, 1] = move_inside(world, k, x, y)
            reports.origin[k, count] = FIRST_INJECTION - m
            count += 1
            left -= 1
    return count
