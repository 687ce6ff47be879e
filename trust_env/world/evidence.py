"""What a frame tells about tracks and agents: who was expected to see a track, who detected it, who holds it.

Judged against each track's mean and covariance after all updates of the frame.
"""

from __future__ import annotations

import math

from trust_env.compiled.jit import compiled
from trust_env.world.fields import (
    F,
    flags1,
    flags2,
    floats1,
    floats2,
    floats3,
    ints1,
    ints2,
    real,
    shape0,
    whole,
)
from trust_env.world.fov import contains
from trust_env.world.tracking.association import NONE, most_pairs_then_least_cost
from trust_env.world.tracking.kalman import innovation_cov
from trust_env.world.tracking.score import CONFIRMED
from trust_env.world.tracking.track_store import EMPTY, n_columns


@compiled
def gather_evidence(world):
    """Fill `expected`, `detected` and `held` `[K, J]`."""
    status = ints1(world, F.track_status)
    expected, detected, held = flags2(world, F.expected), flags2(world, F.detected), flags2(world, F.held)
    mean = floats2(world, F.track_mean)
    listed = list_confirmed(world)
    for k in range(shape0(world, F.pose)):
        for j in range(whole(world, F.columns)):
            held[k, j] = False
            expected[k, j] = (status[j] != EMPTY) & contains(world, k, mean[j, 0], mean[j, 1])
            detected[k, j] = False
        for j in range(whole(world, F.columns), expected.shape[1]):
            expected[k, j], detected[k, j], held[k, j] = False, False, False
        _find_detected(world, k)
        _match_local_tracks(world, k, listed)


@compiled
def _find_detected(world, k):
    """`detected`: any detection of agent k lies within the gate of the track, or within `near_distance` where
    that is set.

    Most tracks are detected by the detection that hit them: it is looked at first.
    """
    status, detected, assignment = (
        ints1(world, F.track_status),
        flags2(world, F.detected)[k],
        ints2(world, F.assignment)[k],
    )
    for d in range(ints1(world, F.report_count)[k]):
        if assignment[d] != NONE:
            detected[assignment[d]] = _is_near(world, k, assignment[d], d, d + 1)
    for j in range(whole(world, F.columns)):
        if (status[j] != EMPTY) & (not detected[j]):
            detected[j] = _is_near(world, k, j, 0, ints1(world, F.report_count)[k])


@compiled
def _is_near(world, k, j, first, last):
    """Whether any of the agent's detections `first` to `last - 1` lies near the track."""
    mean = floats2(world, F.track_mean)[j]
    points = floats3(world, F.reports)[k]
    noise = floats3(world, F.noise_cov)[k]
    xx, xy, yy, det = innovation_cov(floats3(world, F.track_cov)[j], noise[0, 0], noise[0, 1], noise[1, 1])
    gate, near = real(world, F.gate), real(world, F.near_distance)
    limit, found = gate * det, False
    for d in range(first, last):
        dx, dy = points[d, 0] - mean[0], points[d, 1] - mean[1]
        gated = yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy <= limit
        found |= gated | (dx * dx + dy * dy <= near * near)
    return found


@compiled
def _match_local_tracks(world, k, listed):
    """`held`: one-to-one assignment of confirmed central tracks to k's confirmed local tracks within
    `hold_distance`.
    """
    start, pair_column, cost = (
        ints1(world, F.pair_start),
        ints1(world, F.pair_column),
        floats1(world, F.pair_cost),
    )
    columns, local_status = ints1(world, F.listing), ints2(world, F.local_status)[k]
    central, local = floats2(world, F.track_mean), floats3(world, F.local_mean)[k]
    reach, rows, pairs = real(world, F.hold_distance), 0, 0
    for a in range(n_columns(world, k)):
        if local_status[a] != CONFIRMED:
            continue
        start[rows] = pairs
        for c in range(listed):
            dx, dy = local[a, 0] - central[columns[c], 0], local[a, 1] - central[columns[c], 1]
            squared = dx * dx + dy * dy
            pair_column[pairs], cost[pairs] = c, squared
            pairs += int(squared <= reach * reach)
        rows += 1
    start[rows] = pairs
    for p in range(pairs):
        cost[p] = math.sqrt(cost[p])
    most_pairs_then_least_cost(world, rows, listed)
    held, column_row = flags2(world, F.held), ints1(world, F.column_row)
    for c in range(listed):
        held[k, columns[c]] = column_row[c] != NONE


@compiled
def list_confirmed(world):
    """List in `listing` the columns of the confirmed tracks that are not about to be deleted; returns how
    many.
    """
    status, doomed, columns = (
        ints1(world, F.track_status),
        flags1(world, F.track_doomed),
        ints1(world, F.listing),
    )
    listed = 0
    for j in range(whole(world, F.columns)):
        if status[j] == CONFIRMED and not doomed[j]:
            columns[listed] = j
            listed += 1
    return listed
