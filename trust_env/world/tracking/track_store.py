"""The store of a tracker's tracks: columns that are empty or hold a track. Columns never move: a track keeps
its column for life.

A tracker is named by a number: CENTRAL (-1) is the centre's, k ≥ 0 is agent k's own. All columns from
`n_columns` on are empty.
"""

from __future__ import annotations

import numpy as np

from trust_env.compiled.jit import compiled, inlined
from trust_env.world.fields import (
    F,
    floats1,
    floats2,
    floats3,
    floats4,
    ints1,
    ints2,
    real,
    tracker_flags1,
    tracker_floats1,
    tracker_floats2,
    tracker_floats3,
    tracker_ints1,
    whole,
)
from trust_env.world.sensing import DROPPED_BIRTHS, EVICTED_TRACKS
from trust_env.world.tracking import kalman
from trust_env.world.tracking.association import NONE
from trust_env.world.tracking.score import TENTATIVE

EMPTY = 0
CENTRAL = -1
GAVE_WAY = -2  # `scan_assignment` of a detection whose track gave way to a newer one


@inlined
def n_columns(world, tracker):
    return ints1(world, F.columns)[tracker + 1]


@compiled
def clear_store(world, tracker):
    """No tracks; ids begin at 0."""
    ids, status, doomed = _identity(world, tracker)
    ints1(world, F.columns)[tracker + 1], ints1(world, F.next_id)[tracker + 1] = 0, 0
    for j in range(ids.shape[0]):
        ids[j], status[j], doomed[j] = NONE, EMPTY, False


@inlined
def _identity(world, tracker):
    return (
        tracker_ints1(world, tracker, F.track_id),
        tracker_ints1(world, tracker, F.track_status),
        tracker_flags1(world, tracker, F.track_doomed),
    )


@compiled
def start_track(world, tracker, k, weight, d):
    """A new track on detection d of agent k, in the lowest empty column."""
    j = _free_column(world, tracker)
    if j == NONE:
        ints1(world, F.overflow)[DROPPED_BIRTHS] += 1
        return
    mean, cov = tracker_floats2(world, tracker, F.track_mean), tracker_floats3(world, tracker, F.track_cov)
    noise, spread = floats3(world, F.noise_cov)[k], real(world, F.velocity_variance)
    point, initial = floats3(world, F.reports)[k, d], floats1(world, F.initial_score)[k]
    kalman.start(mean[j], cov[j], point[0], point[1], noise, weight, spread)
    ids, status, doomed = _identity(world, tracker)
    next_id, columns = ints1(world, F.next_id), ints1(world, F.columns)
    ids[j], status[j], doomed[j] = next_id[tracker + 1], TENTATIVE, False
    next_id[tracker + 1] += 1
    columns[tracker + 1] = max(columns[tracker + 1], j + 1)
    tracker_floats1(world, tracker, F.track_score)[j] = initial
    tracker_floats1(world, tracker, F.track_initial)[j] = initial
    tracker_floats1(world, tracker, F.track_peak)[j] = -np.inf
    tracker_ints1(world, tracker, F.track_age)[j] = 0
    tracker_ints1(world, tracker, F.track_unseen)[j] = 0
    tracker_ints1(world, tracker, F.track_hits)[j] = 1
    tracker_ints1(world, tracker, F.track_window)[j] = 0
    tracker_flags1(world, tracker, F.track_hit_now)[j] = True
    if tracker == CENTRAL:
        _credit_birth(world, k, j, d)


@compiled
def _free_column(world, tracker):
    """The lowest empty column; in a full store that of the lowest-scored tentative track, which is dropped;
    -1 if there is none.

    Of equal scores (all tracks born in one frame have theirs from L_0) the oldest gives way, whatever its
    column.
    """
    ids, status, _ = _identity(world, tracker)
    score = tracker_floats1(world, tracker, F.track_score)
    weakest, low = NONE, np.inf
    for j in range(status.shape[0]):
        if status[j] == EMPTY:
            return j
        if status[j] == TENTATIVE and (score[j] < low or (score[j] == low and ids[j] < ids[weakest])):
            weakest, low = j, score[j]
    if weakest != NONE:
        ints1(world, F.overflow)[EVICTED_TRACKS] += 1
        _forget_assignments(world, tracker, weakest)
    return weakest


@compiled
def _forget_assignments(world, tracker, j):
    """No detection of this frame may point to the track that just gave way."""
    assignment, of_scan = ints2(world, F.assignment), ints1(world, F.scan_assignment)
    for d in range(of_scan.shape[0]):
        if of_scan[d] == j:
            of_scan[d] = GAVE_WAY  # it had a track, so it starts none
    if tracker == CENTRAL:
        for k in range(assignment.shape[0]):
            for d in range(ints1(world, F.report_count)[k]):
                if assignment[k, d] == j:
                    assignment[k, d] = NONE


@compiled
def _credit_birth(world, k, j, d):
    """Who contributed what to a new central track."""
    agent_score = floats2(world, F.agent_score)
    for other in range(agent_score.shape[0]):
        agent_score[other, j] = 0.0
        if whole(world, F.full_evidence):
            clear_innovation(world, other, j)
    agent_score[k, j] = floats1(world, F.initial_score)[k]
    floats1(world, F.scan_gain)[j] = 0.0
    ints1(world, F.track_injected_hits)[j] = int(ints2(world, F.report_origin)[k, d] <= -2)


@compiled
def clear_innovation(world, k, j):
    """Agent k has not hit track j in this frame."""
    innovation, cov = floats3(world, F.innovation), floats4(world, F.innovation_cov)
    for a in range(2):
        innovation[k, j, a] = np.nan
        for b in range(2):
            cov[k, j, a, b] = np.nan
    floats2(world, F.distance2)[k, j] = np.nan


@compiled
def drop_track(world, tracker, j):
    """Empty a column."""
    ids, status, doomed = _identity(world, tracker)
    columns = ints1(world, F.columns)
    ids[j], status[j], doomed[j] = NONE, EMPTY, False
    while columns[tracker + 1] > 0 and status[columns[tracker + 1] - 1] == EMPTY:
        columns[tracker + 1] -= 1


@compiled
def drop_doomed(world, tracker):
    """Empty the columns of the tracks that are to be deleted."""
    _, status, doomed = _identity(world, tracker)
    for j in range(n_columns(world, tracker) - 1, -1, -1):
        if status[j] != EMPTY and doomed[j]:
            drop_track(world, tracker, j)
