"""The multi-target tracker: one for the centre, one, with a single agent's reports, for every agent.

A frame: `predict_tracks`, then `scan` agent by agent, then `end_frame`. Columns never move: a track keeps its column for life.
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np

from trust_env.core import kalman
from trust_env.core.association import NONE, most_pairs_then_least_cost
from trust_env.core.fov import contains, within_reach
from trust_env.core.jit import compiled
from trust_env.core.layout import (
    F,
    flags1,
    flags2,
    floats1,
    floats2,
    floats3,
    floats4,
    ints1,
    ints2,
    real,
    whole,
)
from trust_env.core.score import CONFIRMED, TENTATIVE, hit_gain, is_confirmed, is_lost
from trust_env.core.sensing import DROPPED_BIRTHS, EVICTED_TRACKS

EMPTY = 0
CENTRAL = -1  # `agent` of the central tracker
IGNORED_WEIGHT = 1e-3  # an agent that counts less does not count

Tracker = namedtuple(
    "Tracker",
    "agent columns next_id id status mean cov score initial peak age unseen hits window hit_now doomed",
)  # arrays over the tracker's columns: id[J] … cov[J, 4, 4]; columns[1]: all columns from there on are empty


@compiled
def central_tracker(world):
    return Tracker(
        CENTRAL,
        ints1(world, F.columns),
        ints1(world, F.next_id),
        ints1(world, F.track_id),
        ints1(world, F.track_status),
        floats2(world, F.track_mean),
        floats3(world, F.track_cov),
        floats1(world, F.track_score),
        floats1(world, F.track_initial),
        floats1(world, F.track_peak),
        ints1(world, F.track_age),
        ints1(world, F.track_unseen),
        ints1(world, F.track_hits),
        ints1(world, F.track_window),
        flags1(world, F.track_hit_now),
        flags1(world, F.track_doomed),
    )


@compiled
def local_tracker(world, k):
    return Tracker(
        k,
        ints1(world, F.local_columns)[k : k + 1],
        ints1(world, F.local_next_id)[k : k + 1],
        ints2(world, F.local_id)[k],
        ints2(world, F.local_status)[k],
        floats3(world, F.local_mean)[k],
        floats4(world, F.local_cov)[k],
        floats2(world, F.local_score)[k],
        floats2(world, F.local_initial)[k],
        floats2(world, F.local_peak)[k],
        ints2(world, F.local_age)[k],
        ints2(world, F.local_unseen)[k],
        ints2(world, F.local_hits)[k],
        ints2(world, F.local_window)[k],
        flags2(world, F.local_hit_now)[k],
        flags2(world, F.local_doomed)[k],
    )


@compiled
def clear_tracker(tracker):
    tracker.columns[0], tracker.next_id[0] = 0, 0
    for j in range(tracker.id.shape[0]):
        tracker.id[j], tracker.status[j], tracker.doomed[j] = NONE, EMPTY, False


@compiled
def predict_tracks(world, tracker):
    dt, q = real(world, F.dt), real(world, F.process_noise)
    for j in range(tracker.columns[0]):
        if tracker.status[j] != EMPTY:
            kalman.predict(tracker.mean[j], tracker.cov[j], dt, q)
            tracker.hit_now[j] = False


@compiled
def scan(world, tracker, k, weight):
    """Take agent k's report: gate, assign, update the hits, score the misses, start a track from every unassigned detection.

    `weight` scales the agent's information: R_k/w and ΔL·w. Afterwards `scan_assignment[D]` holds the column that each detection hit
    (-1: none), and `scan_gain[J]` what each looked-at track gained.
    """
    seen = _gate(world, tracker, k, weight)
    detections, row_column = ints1(world, F.report_count)[k], ints1(world, F.row_column)
    gain, assignment = floats1(world, F.scan_gain), ints1(world, F.scan_assignment)
    columns, column_row, inside = ints1(world, F.scan_columns), ints1(world, F.column_row), flags1(world, F.scan_inside)
    most_pairs_then_least_cost(world, detections, seen)
    for c in range(seen):
        j = columns[c]
        if column_row[c] != NONE:
            _hit(world, tracker, k, weight, j, column_row[c])
        elif inside[c]:
            gain[j] = weight * floats1(world, F.miss_gain)[k]
            tracker.score[j] += gain[j]
    for d in range(detections):
        assignment[d] = columns[row_column[d]] if row_column[d] != NONE else NONE
    for d in range(detections):
        if assignment[d] == NONE:
            _start_track(world, tracker, k, weight, d)


@compiled
def _gate(world, tracker, k, weight):
    """List the tracks in Φ_k or in reach of a detection, and the pairs whose d² lies within the gate; returns how many tracks.

    A track just outside Φ_k can be hit, as its target may be inside, but not missed.
    """
    noise, gate = floats3(world, F.noise_cov)[k], real(world, F.gate)
    points, detections = floats3(world, F.reports)[k], ints1(world, F.report_count)[k]
    columns, geometry = ints1(world, F.scan_columns), floats2(world, F.scan_geometry)
    gain, mean, inside = floats1(world, F.scan_gain), tracker.mean, flags1(world, F.scan_inside)
    farthest, seen = _farthest_detection(world, k), 0
    for j in range(tracker.columns[0]):
        gain[j] = 0.0
        if tracker.status[j] == EMPTY:
            continue
        xx, xy, yy, det = kalman.innovation_cov(tracker.cov[j], noise, weight)
        inside[seen] = contains(world, k, mean[j, 0], mean[j, 1])
        margin = math.sqrt(gate * (xx + yy))  # no detection within the gate is farther from the track
        if inside[seen] or within_reach(world, k, mean[j, 0], mean[j, 1], farthest + margin):
            geometry[seen, 0], geometry[seen, 1] = mean[j, 0], mean[j, 1]
            geometry[seen, 2], geometry[seen, 3], geometry[seen, 4] = yy / det, -2.0 * xy / det, xx / det  # S⁻¹
            geometry[seen, 5] = det
            columns[seen] = j
            seen += 1
    start, pair_column, cost = ints1(world, F.pair_start), ints1(world, F.pair_column), floats1(world, F.pair_cost)
    pairs = 0
    for d in range(detections):
        start[d] = pairs
        x, y = points[d, 0], points[d, 1]
        for c in range(seen):
            dx, dy = x - geometry[c, 0], y - geometry[c, 1]
            distance2 = geometry[c, 2] * dx * dx + geometry[c, 3] * dx * dy + geometry[c, 4] * dy * dy
            if distance2 <= gate:
                pair_column[pairs], cost[pairs] = c, distance2 + math.log(geometry[c, 5])
                pairs += 1
    start[detections] = pairs
    return seen


@compiled
def _farthest_detection(world, k):
    """Distance of the report's farthest detection from agent k, m; noise may have put it outside Φ_k."""
    points, pose, squared = floats3(world, F.reports)[k], floats2(world, F.pose), 0.0
    for d in range(ints1(world, F.report_count)[k]):
        dx, dy = points[d, 0] - pose[k, 0], points[d, 1] - pose[k, 1]
        squared = max(squared, dx * dx + dy * dy)
    return math.sqrt(squared)


@compiled
def _hit(world, tracker, k, weight, j, d):
    """Kalman update and score of a track with its assigned detection."""
    point = floats3(world, F.reports)[k, d]
    dx, dy = point[0] - tracker.mean[j, 0], point[1] - tracker.mean[j, 1]
    xx, xy, yy, det = kalman.innovation_cov(tracker.cov[j], floats3(world, F.noise_cov)[k], weight)
    distance2 = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / det
    gain = weight * hit_gain(floats1(world, F.hit_constant)[k], det, distance2)
    kalman.update(tracker.mean[j], tracker.cov[j], dx, dy, xx, xy, yy, det)
    tracker.score[j] += gain
    tracker.hits[j] += 1
    tracker.hit_now[j] = True
    floats1(world, F.scan_gain)[j] = gain
    if tracker.agent == CENTRAL and whole(world, F.full_evidence):
        innovation, cov = floats3(world, F.innovation), floats4(world, F.innovation_cov)
        innovation[k, j, 0], innovation[k, j, 1] = dx, dy
        cov[k, j, 0, 0], cov[k, j, 0, 1], cov[k, j, 1, 0], cov[k, j, 1, 1] = xx, xy, xy, yy
        floats2(world, F.distance2)[k, j] = distance2


@compiled
def _start_track(world, tracker, k, weight, d):
    """A new track on an unassigned detection, in the lowest empty column."""
    j = _free_column(world, tracker)
    if j == NONE:
        ints1(world, F.overflow)[DROPPED_BIRTHS] += 1
        return
    point = floats3(world, F.reports)[k, d]
    kalman.start(
        tracker.mean[j],
        tracker.cov[j],
        point[0],
        point[1],
        floats3(world, F.noise_cov)[k],
        weight,
        real(world, F.velocity_variance),
    )
    tracker.id[j], tracker.status[j] = tracker.next_id[0], TENTATIVE
    tracker.next_id[0] += 1
    tracker.score[j] = tracker.initial[j] = floats1(world, F.initial_score)[k]
    tracker.peak[j] = -np.inf
    tracker.age[j], tracker.unseen[j], tracker.hits[j], tracker.window[j] = 0, 0, 1, 0
    tracker.hit_now[j], tracker.doomed[j] = True, False
    tracker.columns[0] = max(tracker.columns[0], j + 1)
    if tracker.agent == CENTRAL:
        _credit_birth(world, k, j, d)


@compiled
def _free_column(world, tracker):
    """The lowest empty column; in a full store that of the lowest-scored tentative track, which is dropped; -1 if there is none.

    Of equal scores (all tracks born in one frame have theirs from L_0) the oldest gives way, whatever its column.
    """
    weakest, low = NONE, np.inf
    for j in range(tracker.id.shape[0]):
        if tracker.status[j] == EMPTY:
            return j
        if tracker.status[j] == TENTATIVE and (
            tracker.score[j] < low or (tracker.score[j] == low and tracker.id[j] < tracker.id[weakest])
        ):
            weakest, low = j, tracker.score[j]
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
            of_scan[d] = -2  # it had a track, so it starts none
    if tracker.agent == CENTRAL:
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
            _clear_innovation(world, other, j)
    agent_score[k, j] = floats1(world, F.initial_score)[k]
    floats1(world, F.scan_gain)[j] = 0.0
    ints1(world, F.track_injected_hits)[j] = int(ints2(world, F.report_origin)[k, d] <= -2)


@compiled
def _clear_innovation(world, k, j):
    innovation, cov = floats3(world, F.innovation), floats4(world, F.innovation_cov)
    for a in range(2):
        innovation[k, j, a] = np.nan
        for b in range(2):
            cov[k, j, a, b] = np.nan
    floats2(world, F.distance2)[k, j] = np.nan


@compiled
def end_frame(world, tracker):
    """Confirm (for good), then mark what is to be deleted; maxima run over end-of-frame scores only."""
    for j in range(tracker.columns[0]):
        if tracker.status[j] == EMPTY:
            continue
        tracker.age[j] += 1
        tracker.window[j] = ((tracker.window[j] << 1) | tracker.hit_now[j]) & 0xFFFFFFFF
        tracker.unseen[j] = 0 if tracker.hit_now[j] or _watched(world, tracker, j) else tracker.unseen[j] + 1
        if is_confirmed(world, tracker.score[j], tracker.hits[j], tracker.window[j]):
            tracker.status[j] = CONFIRMED
        tracker.peak[j] = max(tracker.peak[j], tracker.score[j])
        lost = is_lost(world, tracker.score[j], tracker.peak[j], tracker.initial[j], tracker.status[j])
        tracker.doomed[j] = lost or tracker.unseen[j] >= whole(world, F.max_unseen)


@compiled
def _watched(world, tracker, j):
    """Whether the FOV of any agent (a local tracker: of its own) contains the track."""
    x, y = tracker.mean[j, 0], tracker.mean[j, 1]
    if tracker.agent != CENTRAL:
        return contains(world, tracker.agent, x, y)
    for k in range(ints1(world, F.report_count).shape[0]):
        if floats1(world, F.agent_weight)[k] >= IGNORED_WEIGHT and contains(world, k, x, y):
            return True
    return False


@compiled
def drop_track(tracker, j):
    tracker.status[j], tracker.id[j], tracker.doomed[j] = EMPTY, NONE, False
    while tracker.columns[0] > 0 and tracker.status[tracker.columns[0] - 1] == EMPTY:
        tracker.columns[0] -= 1


@compiled
def drop_doomed(tracker):
    for j in range(tracker.columns[0] - 1, -1, -1):
        if tracker.status[j] != EMPTY and tracker.doomed[j]:
            drop_track(tracker, j)
