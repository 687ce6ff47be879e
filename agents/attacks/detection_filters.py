"""The filters of a detection tracker, compiled: one agent after the other, in memory of its own."""

from __future__ import annotations

import math

import numpy as np

from trust_env.compiled.entry import Entry
from trust_env.compiled.kernels import kernel
from trust_env.compiled.structs import floats_at, ints_at

# What a filter knows: m, m/s; the covariance of both axes; frames since the last detection, -1: an empty slot.
X, Y, VX, VY, P_XX, P_XV, P_VV, MISSED, X_PREDICTED, Y_PREDICTED = range(10)
FIELDS = 10
_DT, _PROCESS_NOISE, _VELOCITY_VARIANCE, _GATE, _PATIENCE = range(5)
_NUMBERS = 5
_NONE = -1


@kernel
def _predict(targets, count, numbers):
    """Kalman prediction of all targets; returns the end of the slots that hold one."""
    dt, q, end = numbers[_DT], numbers[_PROCESS_NOISE], 0
    for t in range(count):
        at = FIELDS * t
        if targets[at + MISSED] >= 0.0:
            end = t + 1
            targets[at + X] += dt * targets[at + VX]
            targets[at + Y] += dt * targets[at + VY]
            targets[at + X_PREDICTED], targets[at + Y_PREDICTED] = targets[at + X], targets[at + Y]
            targets[at + P_XX] += 2.0 * dt * targets[at + P_XV] + dt * dt * targets[at + P_VV] + q * dt**3 / 3.0
            targets[at + P_XV] += dt * targets[at + P_VV] + q * dt * dt / 2.0
            targets[at + P_VV] += q * dt
            targets[at + MISSED] += 1.0
    return end


@kernel
def _find_distances(targets, end, seen, detections, cost, noise, gate):
    """d² of detections and targets, [D, T]; infinite outside the gate."""
    for d in range(detections):
        for t in range(end):
            at = FIELDS * t
            dx, dy = seen[2 * d] - targets[at + X], seen[2 * d + 1] - targets[at + Y]
            distance2 = (dx * dx + dy * dy) / (targets[at + P_XX] + noise)
            # A detection that is not there is NaN, and below no gate.
            cost[d * end + t] = distance2 if targets[at + MISSED] >= 0.0 and distance2 <= gate else np.inf


@kernel
def _take_least(cost, detections, end, assigned):
    """Assign the pair of least d², and give up all others of either; returns its place, or -1: there is none."""
    best, least = _NONE, np.inf
    for pair in range(detections * end):
        if cost[pair] < least:
            best, least = pair, cost[pair]
    if best != _NONE:
        first, t = best - best % end, best % end
        assigned[best // end] = t
        for other in range(end):
            cost[first + other] = np.inf
        for d in range(detections):
            cost[d * end + t] = np.inf
    return best


@kernel
def _correct(targets, at, x, y, noise):
    """Kalman update of a target with its detection."""
    dx, dy = x - targets[at + X], y - targets[at + Y]
    s, p_xv = targets[at + P_XX] + noise, targets[at + P_XV]
    k_x, k_v = targets[at + P_XX] / s, p_xv / s
    targets[at + X] += k_x * dx
    targets[at + Y] += k_x * dy
    targets[at + VX] += k_v * dx
    targets[at + VY] += k_v * dy
    targets[at + P_VV] -= k_v * p_xv
    targets[at + P_XV] -= k_x * p_xv
    targets[at + P_XX] -= k_x * targets[at + P_XX]
    targets[at + MISSED] = 0.0


@kernel
def _start(targets, count, x, y, noise, velocity_variance):
    """A new target in the first empty slot, else in that which has been missed longest; returns its slot."""
    slot, longest = 0, -1.0
    for t in range(count):
        missed = targets[FIELDS * t + MISSED]
        if missed < 0.0:
            slot = t
            break
        if missed > longest:
            slot, longest = t, missed
    at = FIELDS * slot
    targets[at + X], targets[at + Y], targets[at + VX], targets[at + VY] = x, y, 0.0, 0.0
    targets[at + X_PREDICTED], targets[at + Y_PREDICTED], targets[at + MISSED] = x, y, 0.0
    targets[at + P_XX], targets[at + P_XV], targets[at + P_VV] = noise, 0.0, velocity_variance
    return slot


@kernel
def follow(targets, count, seen, detections, assigned, cost, noise, numbers):
    """One frame of an agent: predict, pair by d², update, drop what has been missed for too long, start new ones.

    assigned[D]: the slot of each detection, from `count` on of new targets; -1: no detection.
    """
    end = _predict(targets, count, numbers)
    _find_distances(targets, end, seen, detections, cost, noise, numbers[_GATE])
    for d in range(detections):
        assigned[d] = _NONE
    while _take_least(cost, detections, end, assigned) != _NONE:
        pass
    for d in range(detections):
        if assigned[d] != _NONE:
            _correct(targets, FIELDS * assigned[d], seen[2 * d], seen[2 * d + 1], noise)
    for t in range(end):
        if targets[FIELDS * t + MISSED] > numbers[_PATIENCE]:
            targets[FIELDS * t + MISSED] = -1.0
    for d in range(detections):
        if assigned[d] == _NONE and not math.isnan(seen[2 * d]):
            x, y = seen[2 * d], seen[2 * d + 1]
            assigned[d] = count + _start(targets, count, x, y, noise, numbers[_VELOCITY_VARIANCE])


def _detection_filters(rows, agents, count, detections, state, points, assigned, cost, noise, numbers):
    for row in range(rows):
        follow(
            floats_at(state + 8 * FIELDS * count * row, FIELDS * count),
            count,
            floats_at(points + 16 * detections * row, 2 * detections),
            detections,
            ints_at(assigned + 8 * detections * row, detections),
            floats_at(cost, count * detections),
            floats_at(noise, agents)[row % agents],
            floats_at(numbers, _NUMBERS),
        )


_follow_all = Entry(_detection_filters)


def follow_all(
    state: np.ndarray, seen: np.ndarray, noise: np.ndarray, numbers: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The slot int[W, n, D] of the target of every detection seen[W, n, D, 2] (m; NaN: none, slot -1), and which
    targets are new, bool; `state[W, n, T, FIELDS]` goes on by a frame.

    noise[n]: m², of x and of y. numbers: s, m²/s³, (m/s)², the gate of d², frames of patience.
    """
    (worlds, agents, count, _), detections = state.shape, seen.shape[2]
    seen, noise = np.ascontiguousarray(seen, dtype=np.float64), np.ascontiguousarray(noise, dtype=np.float64)
    assigned = np.empty((worlds, agents, detections), dtype=np.int64)
    cost = np.empty(count * detections)
    addresses = [array.ctypes.data for array in (state, seen, assigned, cost, noise, numbers)]
    _follow_all(worlds * agents, agents, count, detections, *addresses)
    new = assigned >= count
    return np.where(new, assigned - count, assigned), new
