"""What a frame tells about tracks and agents: who was expected to see a track, who detected it, who hit it, who
holds it.

Judged against each track's mean and covariance after all updates of the frame.
"""

from __future__ import annotations

import math

from trust_env.compiled.kernels import kernel
from trust_env.world.coverage import cover
from trust_env.world.fields import tracks_of
from trust_env.world.fov import contains, probability_inside
from trust_env.world.tracking.association import NONE, max_cardinality_assignment
from trust_env.world.tracking.kalman import innovation_cov
from trust_env.world.tracking.score import CONFIRMED
from trust_env.world.tracking.track_store import EMPTY, list_confirmed


@kernel
def gather_evidence(world):
    """Fill `expected`, `detected`, `hit` and `held` `[K, J]`, and what the defense asked for."""
    tracks, evidence, listed = world.tracks, world.evidence, list_confirmed(world)
    for k in range(evidence.expected.shape[0]):
        for j in range(evidence.expected.shape[1]):
            evidence.expected[k, j], evidence.detected[k, j], evidence.held[k, j] = False, False, False
            evidence.hit[k, j] = False
        for j in range(tracks.count):
            inside = contains(world, k, tracks.mean[j, 0], tracks.mean[j, 1])
            evidence.expected[k, j] = (tracks.status[j] != EMPTY) & inside
        _find_detected(world, k)
        _match_local_tracks(world, k, listed)
    if world.parameters.keep_inside:
        _find_inside(world)
    if world.parameters.keep_coverage:
        cover(world)


@kernel
def _find_detected(world, k):
    """`hit`, and `detected`: any detection of agent k lies within the gate of the track, or within
    `near_distance` where that is set.

    Most tracks are detected by the detection that hit them: it is looked at first.
    """
    tracks, detected, assignment = world.tracks, world.evidence.detected[k], world.evidence.assignment[k]
    detections = world.reports.count[k]
    for d in range(detections):
        if assignment[d] != NONE:
            world.evidence.hit[k, assignment[d]] = True
            detected[assignment[d]] = _is_near(world, k, assignment[d], d, d + 1)
    for j in range(tracks.count):
        if (tracks.status[j] != EMPTY) & (not detected[j]):
            detected[j] = _is_near(world, k, j, 0, detections)


@kernel
def _is_near(world, k, j, first, last):
    """Whether any of the agent's detections `first` to `last - 1` lies near the track."""
    mean, points, noise = world.tracks.mean[j], world.reports.detections[k], world.agents.noise_cov[k]
    xx, xy, yy, det = innovation_cov(world.tracks.cov[j], noise[0, 0], noise[0, 1], noise[1, 1])
    limit, near, found = world.parameters.gate * det, world.parameters.near_distance, False
    for d in range(first, last):
        dx, dy = points[d, 0] - mean[0], points[d, 1] - mean[1]
        gated = yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy <= limit
        found |= gated | (dx * dx + dy * dy <= near * near)
    return found


@kernel
def _find_inside(world):
    """`inside`: how probable it is that each track lies in each FOV."""
    tracks, inside = world.tracks, world.evidence.inside
    for k in range(inside.shape[0]):
        for j in range(tracks.count):
            mean, cov = tracks.mean[j], tracks.cov[j]
            inside[k, j] = probability_inside(world, k, mean[0], mean[1], cov[0, 0], cov[0, 1], cov[1, 1])


@kernel
def _match_local_tracks(world, k, listed):
    """`held`: one-to-one assignment of confirmed central tracks to k's confirmed local tracks within
    `hold_distance`.
    """
    local, pairs, columns = tracks_of(world, k), world.pairs, world.scratch.listing
    reach, rows, found = world.parameters.hold_distance, 0, 0
    for a in range(local.count):
        if local.status[a] != CONFIRMED:
            continue
        pairs.start[rows] = found
        for c in range(listed):
            central = world.tracks.mean[columns[c]]
            dx, dy = local.mean[a, 0] - central[0], local.mean[a, 1] - central[1]
            squared = dx * dx + dy * dy
            pairs.column[found], pairs.cost[found] = c, squared
            found += int(squared <= reach * reach)
        rows += 1
    pairs.start[rows] = found
    for p in range(found):
        pairs.cost[p] = math.sqrt(pairs.cost[p])
    max_cardinality_assignment(world, rows, listed)
    for c in range(listed):
        world.evidence.held[k, columns[c]] = world.matching.column_row[c] != NONE
