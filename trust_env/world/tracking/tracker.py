"""The multi-target tracker: one for the centre, one, with a single agent's reports, for every agent.

A frame: `predict_tracks`, then `scan` agent by agent, then `end_frame`. `tracker` is CENTRAL or an agent's
index, as in `store.py`.
"""

from __future__ import annotations

import math

from trust_env.compiled.jit import compiled, inlined
from trust_env.world.fields import (
    F,
    flags1,
    floats1,
    floats2,
    floats3,
    floats4,
    ints1,
    real,
    tracker_flags1,
    tracker_floats1,
    tracker_floats2,
    tracker_floats3,
    tracker_ints1,
    whole,
)
from trust_env.world.fov import contains, within_reach
from trust_env.world.tracking import kalman
from trust_env.world.tracking.association import NONE, most_pairs_then_least_cost
from trust_env.world.tracking.score import CONFIRMED, hit_gain, is_confirmed, is_lost
from trust_env.world.tracking.track_store import CENTRAL, EMPTY, n_columns, start_track

IGNORED_WEIGHT = 1e-3  # an agent that counts less does not count


@inlined
def predict_tracks(world, tracker):
    """Kalman prediction of all tracks over `dt`."""
    status, hit_now = (
        tracker_ints1(world, tracker, F.track_status),
        tracker_flags1(world, tracker, F.track_hit_now),
    )
    mean, cov = tracker_floats2(world, tracker, F.track_mean), tracker_floats3(world, tracker, F.track_cov)
    dt, q = real(world, F.dt), real(world, F.process_noise)
    for j in range(n_columns(world, tracker)):
        if status[j] != EMPTY:
            kalman.predict(mean[j], cov[j], dt, q)
            hit_now[j] = False


@compiled
def scan(world, tracker, k, weight):
    """Take agent k's report: gate, assign, update the hits, score the misses, start a track from every
    unassigned detection.

    `weight` scales the agent's information: R_k/w and ΔL·w. Afterwards `scan_assignment[D]` holds the column
    that each detection hit (negative: none), and `scan_gain[J]` what each looked-at track gained.
    """
    seen = _gate(world, tracker, k, weight)
    detections, row_column = ints1(world, F.report_count)[k], ints1(world, F.row_column)
    gain, assignment = floats1(world, F.scan_gain), ints1(world, F.scan_assignment)
    columns, column_row, inside = (
        ints1(world, F.scan_columns),
        ints1(world, F.column_row),
        flags1(world, F.scan_inside),
    )
    score, miss_gain = tracker_floats1(world, tracker, F.track_score), weight * floats1(world, F.miss_gain)[k]
    most_pairs_then_least_cost(world, detections, seen)
    for c in range(seen):
        missed = miss_gain if inside[c] & (column_row[c] == NONE) else 0.0
        gain[columns[c]] = missed
        score[columns[c]] += missed
    for d in range(detections):
        assignment[d] = NONE
        if row_column[d] != NONE:
            assignment[d] = columns[row_column[d]]
            _hit(world, tracker, k, weight, row_column[d], d)
    for d in range(detections):
        if assignment[d] == NONE:
            start_track(world, tracker, k, weight, d)


@compiled
def _gate(world, tracker, k, weight):
    """List the tracks in Φ_k or in reach of a detection, and the pairs whose d² lies within the gate; returns
    how many tracks.

    A track just outside Φ_k can be hit, as its target may be inside, but not missed.
    """
    status, mean = (
        tracker_ints1(world, tracker, F.track_status),
        tracker_floats2(world, tracker, F.track_mean),
    )
    cov, noise, gate = (
        tracker_floats3(world, tracker, F.track_cov),
        floats3(world, F.noise_cov)[k],
        real(world, F.gate),
    )
    columns, geometry = ints1(world, F.scan_columns), floats2(world, F.scan_geometry)
    gain, inside = floats1(world, F.scan_gain), flags1(world, F.scan_inside)
    rxx, rxy, ryy = noise[0, 0] / weight, noise[0, 1] / weight, noise[1, 1] / weight
    farthest, seen = _farthest_detection(world, k), 0
    for j in range(n_columns(world, tracker)):
        # Written first, counted after: whether a track is listed is hard to predict, for the processor too.
        gain[j] = 0.0
        xx, xy, yy, det = kalman.innovation_cov(cov[j], rxx, rxy, ryy)
        inside[seen] = contains(world, k, mean[j, 0], mean[j, 1])
        margin = math.sqrt(gate * (xx + yy))  # no detection within the gate is farther from the track
        reached = inside[seen] | within_reach(world, k, mean[j, 0], mean[j, 1], farthest + margin)
        geometry[seen, 0], geometry[seen, 1] = mean[j, 0], mean[j, 1]
        geometry[seen, 2], geometry[seen, 3], geometry[seen, 4] = yy / det, -xy / det, xx / det  # S⁻¹
        geometry[seen, 5] = det
        columns[seen] = j
        seen += int(reached & (status[j] != EMPTY))
    _list_pairs(world, k, seen, gate)
    return seen


@compiled
def _list_pairs(world, k, seen, gate):
    """Pairs of detections and listed tracks within the gate; the cost of a pair is d² + ln|S|."""
    points, detections, geometry = (
        floats3(world, F.reports)[k],
        ints1(world, F.report_count)[k],
        floats2(world, F.scan_geometry),
    )
    start, pair_column, cost = (
        ints1(world, F.pair_start),
        ints1(world, F.pair_column),
        floats1(world, F.pair_cost),
    )
    pairs = 0
    for d in range(detections):
        start[d] = pairs
        x, y = points[d, 0], points[d, 1]
        for c in range(seen):
            dx, dy = x - geometry[c, 0], y - geometry[c, 1]
            distance2 = geometry[c, 2] * dx * dx + 2.0 * geometry[c, 3] * dx * dy + geometry[c, 4] * dy * dy
            pair_column[pairs], cost[pairs] = c, distance2
            pairs += int(distance2 <= gate)
    start[detections] = pairs
    for p in range(pairs):
        geometry[pair_column[p], 6] = math.log(geometry[pair_column[p], 5])
        cost[p] += geometry[pair_column[p], 6]


@inlined
def _farthest_detection(world, k):
    """Distance of the report's farthest detection from agent k, m; noise may have put it outside Φ_k."""
    points, pose, squared = floats3(world, F.reports)[k], floats2(world, F.pose), 0.0
    for d in range(ints1(world, F.report_count)[k]):
        dx, dy = points[d, 0] - pose[k, 0], points[d, 1] - pose[k, 1]
        squared = max(squared, dx * dx + dy * dy)
    return math.sqrt(squared)


@compiled
def _hit(world, tracker, k, weight, c, d):
    """Kalman update and score of listed track c with its assigned detection."""
    j, geometry = ints1(world, F.scan_columns)[c], floats2(world, F.scan_geometry)[c]
    mean, cov = (
        tracker_floats2(world, tracker, F.track_mean)[j],
        tracker_floats3(world, tracker, F.track_cov)[j],
    )
    point = floats3(world, F.reports)[k, d]
    dx, dy, ixx, ixy, iyy = point[0] - mean[0], point[1] - mean[1], geometry[2], geometry[3], geometry[4]
    distance2 = ixx * dx * dx + 2.0 * ixy * dx * dy + iyy * dy * dy
    gain = weight * hit_gain(floats1(world, F.hit_constant)[k], geometry[6], distance2)
    if tracker == CENTRAL and whole(world, F.full_evidence):
        _remember_innovation(world, k, weight, j, dx, dy, distance2)
    kalman.update(mean, cov, dx, dy, ixx, ixy, iyy)
    tracker_floats1(world, tracker, F.track_score)[j] += gain
    tracker_ints1(world, tracker, F.track_hits)[j] += 1
    tracker_flags1(world, tracker, F.track_hit_now)[j] = True
    floats1(world, F.scan_gain)[j] = gain


@compiled
def _remember_innovation(world, k, weight, j, dx, dy, distance2):
    """Evidence for defenses that ask for it: innovation, S and d² of a central track's hit."""
    innovation, innovation_cov = floats3(world, F.innovation), floats4(world, F.innovation_cov)
    noise, cov = floats3(world, F.noise_cov)[k], floats3(world, F.track_cov)[j]
    innovation[k, j, 0], innovation[k, j, 1] = dx, dy
    for a in range(2):
        for b in range(2):
            innovation_cov[k, j, a, b] = cov[a, b] + noise[a, b] / weight
    floats2(world, F.distance2)[k, j] = distance2


@compiled
def end_frame(world, tracker):
    """Confirm (for good), then mark what is to be deleted; maxima run over end-of-frame scores only."""
    status, doomed = (
        tracker_ints1(world, tracker, F.track_status),
        tracker_flags1(world, tracker, F.track_doomed),
    )
    score, peak = (
        tracker_floats1(world, tracker, F.track_score),
        tracker_floats1(world, tracker, F.track_peak),
    )
    age, unseen = tracker_ints1(world, tracker, F.track_age), tracker_ints1(world, tracker, F.track_unseen)
    hits, window = tracker_ints1(world, tracker, F.track_hits), tracker_ints1(world, tracker, F.track_window)
    hit_now, initial = (
        tracker_flags1(world, tracker, F.track_hit_now),
        tracker_floats1(world, tracker, F.track_initial),
    )
    mean, max_unseen = tracker_floats2(world, tracker, F.track_mean), whole(world, F.max_unseen)
    for j in range(n_columns(world, tracker)):
        if status[j] == EMPTY:
            continue
        age[j] += 1
        window[j] = ((window[j] << 1) | hit_now[j]) & 0xFFFFFFFF
        unseen[j] = 0 if hit_now[j] or _watched(world, tracker, mean[j, 0], mean[j, 1]) else unseen[j] + 1
        if is_confirmed(world, score[j], hits[j], window[j]):
            status[j] = CONFIRMED
        peak[j] = max(peak[j], score[j])
        doomed[j] = unseen[j] >= max_unseen or is_lost(world, score[j], peak[j], initial[j], status[j])


@compiled
def _watched(world, tracker, x, y):
    """Whether the FOV of any agent that counts (a local tracker: of its own) contains the point."""
    if tracker != CENTRAL:
        return contains(world, tracker, x, y)
    weight = floats1(world, F.agent_weight)
    for k in range(weight.shape[0]):
        if weight[k] >= IGNORED_WEIGHT and contains(world, k, x, y):
            return True
    return False
