"""Step 1 of a frame: each agent's action edits its own raw detections, within its budget."""

from __future__ import annotations

from trust_env.compiled.jit import compiled
from trust_env.world.fields import F, floats2, floats3, ints1, ints2, shape0, shape1
from trust_env.world.fov import move_inside
from trust_env.world.sensing import FULL_DETECTIONS, FULL_INJECTIONS

INJECTION_ORIGIN = -2  # `report_origin` of injection slot m is INJECTION_ORIGIN - m


@compiled
def edit_reports(world):
    """Reports of all agents: honest detections that are not suppressed, in list order, then injections by
    slot.
    """
    for k in range(shape0(world, F.pose)):
        injections = _count_injections(world, k)
        kept = _keep_honest(world, k, shape1(world, F.reports) - injections)
        ints1(world, F.report_count)[k] = _inject(world, k, kept, injections)


@compiled
def _count_injections(world, k):
    """How many injection slots fire and fit."""
    action, fired = floats2(world, F.action)[k], 0
    for m in range(ints1(world, F.injection_budget)[k]):
        fired += action[3 * m] > 0.0
    capacity = shape1(world, F.reports)
    if fired > capacity:
        ints1(world, F.overflow)[FULL_INJECTIONS] += fired - capacity
        return capacity
    return fired


@compiled
def _keep_honest(world, k, room):
    """Copy the detections that are not suppressed, as many as there is room for; the farthest do not fit."""
    action, raw, origin = (
        floats2(world, F.action)[k],
        floats3(world, F.raw_detections)[k],
        ints2(world, F.raw_origin)[k],
    )
    report, report_origin = floats3(world, F.reports)[k], ints2(world, F.report_origin)[k]
    first = action.shape[0] - raw.shape[0]
    budget, kept = ints1(world, F.suppression_budget)[k], 0
    for d in range(ints1(world, F.raw_count)[k]):
        if d < budget and action[first + d] > 0.0:
            continue
        if kept == room:
            ints1(world, F.overflow)[FULL_DETECTIONS] += 1
            continue
        report[kept, 0], report[kept, 1], report_origin[kept] = raw[d, 0], raw[d, 1], origin[d]
        kept += 1
    return kept


@compiled
def _inject(world, k, count, injections):
    """Append the injections that fire; actions are scaled to the FOV's bounding box, and end inside the
    FOV.
    """
    action, box = floats2(world, F.action)[k], floats2(world, F.fov_box)[k]
    report, report_origin = floats3(world, F.reports)[k], ints2(world, F.report_origin)[k]
    left = injections
    for m in range(ints1(world, F.injection_budget)[k]):
        if action[3 * m] > 0.0 and left > 0:
            u = 0.5 + 0.5 * min(1.0, max(-1.0, action[3 * m + 1]))
            v = 0.5 + 0.5 * min(1.0, max(-1.0, action[3 * m + 2]))
            report[count, 0], report[count, 1] = move_inside(
                world, k, box[0] + u * (box[1] - box[0]), box[2] + v * (box[3] - box[2])
            )
            report_origin[count] = INJECTION_ORIGIN - m
            count += 1
            left -= 1
    return count
