"""The multi-target tracker: one for the centre, one, with a single agent's reports, for every agent.

A frame: `predict_tracks`, then `scan_report` agent by agent, then `end_frame`. `tracker` is CENTRAL or an agent's
index, as in `track_store`.
"""

from __future__ import annotations

import math

from trust_env.compiled.kernels import inlined, kernel
from trust_env.compiled.structs import CENTRAL
from trust_env.world.fields import tracks_of
from trust_env.world.fov import contains, within_reach
from trust_env.world.origin import is_injection
from trust_env.world.tracking import kalman
from trust_env.world.tracking.association import NONE, max_cardinality_assignment
from trust_env.world.tracking.fusion import SEQUENTIAL, fuse_hits, keep_hit
from trust_env.world.tracking.score import CONFIRMED, hit_gain, is_confirmed, is_lost
from trust_env.world.tracking.track_store import EMPTY, clear_innovation, delete_marked, start_track

IGNORED_WEIGHT = 1e-3  # reports below this weight are ignored


@kernel
def track_locally(world):
    """Every agent's own tracker takes its report."""
    for k in range(world.agents.role.shape[0]):
        predict_tracks(world, k)
        scan_report(world, k, k, 1.0)
        end_frame(world, k)
        delete_marked(world, k)


@kernel
def track_centrally(world):
    """The central tracker takes the reports, agent by agent; hits update their track at once, or all together."""
    agents = world.agents.role.shape[0]
    predict_tracks(world, CENTRAL)
    if world.parameters.keep_predictions:
        _keep_predictions(world)
    if world.parameters.keep_innovations:
        for k in range(agents):
            for j in range(world.tracks.count):
                clear_innovation(world, k, j)
    if world.parameters.fusion != SEQUENTIAL:
        for j in range(world.kept.hits.shape[0]):
            world.kept.hits[j] = 0
    for k in range(agents):
        _take_report(world, k)
    if world.parameters.fusion != SEQUENTIAL:
        fuse_hits(world)
    end_frame(world, CENTRAL)


@kernel
def _keep_predictions(world):
    """Evidence for defenses that ask for it: where the tracks are before any report, for hits at one epoch."""
    tracks, evidence = world.tracks, world.evidence
    for j in range(tracks.count):
        for a in range(4):
            evidence.predicted_mean[j, a] = tracks.mean[j, a]
            for b in range(4):
                evidence.predicted_cov[j, a, b] = tracks.cov[j, a, b]


@kernel
def _take_report(world, k):
    """The central tracker takes agent k's report, and the books are kept on who contributed what."""
    evidence, scan, weight = world.evidence, world.scan, world.verdict.agent_weight[k]
    if weight < IGNORED_WEIGHT:
        for d in range(world.reports.count[k]):
            evidence.assignment[k, d] = NONE
        return
    scan_report(world, CENTRAL, k, weight)
    for j in range(world.tracks.count):
        evidence.agent_score[k, j] += scan.gain[j]
    for d in range(world.reports.count[k]):
        j = scan.assignment[d]
        evidence.assignment[k, d] = max(j, NONE)
        if j >= 0 and is_injection(world.reports.origin[k, d]):
            world.labels.injected_hits[j] += 1


@inlined
def predict_tracks(world, tracker):
    """Kalman prediction of all tracks over `dt`."""
    tracks = tracks_of(world, tracker)
    for j in range(tracks.count):
        if tracks.status[j] != EMPTY:
            kalman.predict(tracks.mean[j], tracks.cov[j], world.clock.dt, world.parameters.process_noise)
            tracks.hit_now[j] = False


@kernel
def scan_report(world, tracker, k, weight):
    """Take agent k's report: gate, assign, update the hits, score the misses, start a track from every
    unassigned detection.

    weight: scales the agent's information, R_k/w and ΔL·w. Afterwards `scan.assignment[D]` holds the column
    that each detection hit (negative: none), and `scan.gain[J]` what each track gained.
    """
    listed = _gate(world, tracker, k, weight)
    tracks, scan, matching = tracks_of(world, tracker), world.scan, world.matching
    detections, miss_gain = world.reports.count[k], weight * world.agents.miss_gain[k]
    max_cardinality_assignment(world, detections, listed)
    for c in range(listed):
        missed = miss_gain if scan.inside[c] & (matching.column_row[c] == NONE) else 0.0
        scan.gain[scan.columns[c]] = missed
        tracks.score[scan.columns[c]] += missed
    for d in range(detections):
        scan.assignment[d] = NONE
        if matching.row_column[d] != NONE:
            scan.assignment[d] = scan.columns[matching.row_column[d]]
            _hit(world, tracker, k, weight, matching.row_column[d], d)
    for d in range(detections):
        if scan.assignment[d] == NONE:
            start_track(world, tracker, k, weight, d)


@kernel
def _gate(world, tracker, k, weight):
    """List the tracks in Φ_k or in reach of a detection, and the pairs whose d² lies within the gate; returns
    how many tracks.

    A track just outside Φ_k can be hit, as its target may be inside, but not missed.
    """
    tracks, scan, (rxx, rxy, ryy) = tracks_of(world, tracker), world.scan, _noise(world, k, weight)
    gate, farthest, listed = world.parameters.gate, _farthest_detection(world, k), 0
    for j in range(tracks.count):
        # Written first, counted after: whether a track is listed is hard to predict, for the processor too.
        x, y, scan.gain[j] = tracks.mean[j, 0], tracks.mean[j, 1], 0.0
        xx, xy, yy, det = kalman.innovation_cov(tracks.cov[j], rxx, rxy, ryy)
        scan.inside[listed] = contains(world, k, x, y)
        margin = math.sqrt(gate * (xx + yy))  # no detection within the gate is farther from the track
        reached = scan.inside[listed] | within_reach(world, k, x, y, farthest + margin)
        of_track = scan.geometry[listed]
        of_track[0], of_track[1] = x, y
        of_track[2], of_track[3], of_track[4] = yy / det, -xy / det, xx / det  # S⁻¹
        of_track[5] = det
        scan.columns[listed] = j
        listed += int(reached & (tracks.status[j] != EMPTY))
    _list_pairs(world, k, listed)
    return listed


@kernel
def _list_pairs(world, k, listed):
    """Pairs of detections and listed tracks within the gate; the cost of a pair is d² + ln|S|."""
    pairs, geometry, gate = world.pairs, world.scan.geometry, world.parameters.gate
    detections, found = world.reports.count[k], 0
    for d in range(detections):
        pairs.start[d] = found
        x, y = world.reports.detections[k, d, 0], world.reports.detections[k, d, 1]
        for c in range(listed):
            dx, dy = x - geometry[c, 0], y - geometry[c, 1]
            distance2 = geometry[c, 2] * dx * dx + 2.0 * geometry[c, 3] * dx * dy + geometry[c, 4] * dy * dy
            pairs.column[found], pairs.cost[found] = c, distance2
            found += int(distance2 <= gate)
    pairs.start[detections] = found
    for p in range(found):
        c = pairs.column[p]
        geometry[c, 6] = math.log(geometry[c, 5])
        pairs.cost[p] += geometry[c, 6]


@inlined
def _noise(world, k, weight):
    """R_k/w by its entries xx, xy, yy, m²."""
    noise = world.agents.noise_cov[k]
    return noise[0, 0] / weight, noise[0, 1] / weight, noise[1, 1] / weight


@inlined
def _farthest_detection(world, k):
    """Distance of the report's farthest detection from agent k, m; noise may have put it outside Φ_k."""
    reports, pose, squared = world.reports, world.agents.pose, 0.0
    for d in range(reports.count[k]):
        dx, dy = reports.detections[k, d, 0] - pose[k, 0], reports.detections[k, d, 1] - pose[k, 1]
        squared = max(squared, dx * dx + dy * dy)
    return math.sqrt(squared)


@kernel
def _hit(world, tracker, k, weight, c, d):
    """Kalman update and score of listed track c with its assigned detection."""
    tracks, j, geometry = tracks_of(world, tracker), world.scan.columns[c], world.scan.geometry[c]
    point, mean, cov = world.reports.detections[k, d], tracks.mean[j], tracks.cov[j]
    dx, dy, ixx, ixy, iyy = point[0] - mean[0], point[1] - mean[1], geometry[2], geometry[3], geometry[4]
    distance2 = ixx * dx * dx + 2.0 * ixy * dx * dy + iyy * dy * dy
    gain = weight * hit_gain(world.agents.hit_constant[k], geometry[6], distance2)
    if tracker == CENTRAL and world.parameters.keep_innovations:
        _keep_innovation(world, k, weight, j, dx, dy, distance2)
    if tracker == CENTRAL and world.parameters.fusion != SEQUENTIAL:
        keep_hit(world, k, weight, j, point[0], point[1])
    else:
        kalman.update(mean, cov, dx, dy, _noise(world, k, weight), (ixx, ixy, iyy), geometry[5])
    tracks.score[j] += gain
    tracks.hits[j] += 1
    tracks.hit_now[j] = True
    world.scan.gain[j] = gain


@kernel
def _keep_innovation(world, k, weight, j, dx, dy, distance2):
    """Evidence for defenses that ask for it: innovation, S and d² of a central track's hit."""
    evidence, noise = world.evidence, world.agents.noise_cov[k]
    evidence.innovation[k, j, 0], evidence.innovation[k, j, 1] = dx, dy
    for a in range(2):
        for b in range(2):
            evidence.innovation_cov[k, j, a, b] = world.tracks.cov[j, a, b] + noise[a, b] / weight
    evidence.distance2[k, j] = distance2


@kernel
def end_frame(world, tracker):
    """Confirm (for good), then mark what is to be deleted; maxima run over end-of-frame scores only."""
    tracks, max_unseen = tracks_of(world, tracker), world.parameters.max_unseen
    for j in range(tracks.count):
        if tracks.status[j] == EMPTY:
            continue
        score, hit = tracks.score[j], tracks.hit_now[j]
        tracks.age[j] += 1
        tracks.window[j] = ((tracks.window[j] << 1) | hit) & 0xFFFFFFFF
        seen = hit or _is_watched(world, tracker, tracks.mean[j, 0], tracks.mean[j, 1])
        tracks.unseen[j] = 0 if seen else tracks.unseen[j] + 1
        if is_confirmed(world, score, tracks.hits[j], tracks.window[j]):
            tracks.status[j] = CONFIRMED
        tracks.peak[j] = max(tracks.peak[j], score)
        lost = is_lost(world, score, tracks.peak[j], tracks.initial[j], tracks.status[j])
        tracks.to_delete[j] = tracks.unseen[j] >= max_unseen or lost


@kernel
def _is_watched(world, tracker, x, y):
    """Whether the FOV of any agent that is not ignored (a local tracker: of its own) contains the point."""
    if tracker != CENTRAL:
        return contains(world, tracker, x, y)
    weight = world.verdict.agent_weight
    for k in range(weight.shape[0]):
        if weight[k] >= IGNORED_WEIGHT and contains(world, k, x, y):
            return True
    return False
