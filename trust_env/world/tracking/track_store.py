"""The store of a tracker's tracks: columns that are empty or hold a track. Columns never move: a track keeps
its column for life.

A tracker is named by a number: CENTRAL (-1) is the centre's, k ≥ 0 is agent k's own. All columns from
`tracks.count` on are empty.
"""

from __future__ import annotations

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.compiled.structs import CENTRAL
from trust_env.world.fields import tracks_of
from trust_env.world.origin import is_injection
from trust_env.world.tracking import kalman
from trust_env.world.tracking.association import NONE
from trust_env.world.tracking.fusion import SEQUENTIAL
from trust_env.world.tracking.score import CONFIRMED, TENTATIVE

EMPTY = 0
EVICTED = -2  # `scan.assignment` of a detection whose track has given way to a newer one


@kernel
def clear_store(world, tracker):
    """No tracks; ids begin at 0."""
    tracks = tracks_of(world, tracker)
    tracks.count, tracks.next_id = 0, 0
    for j in range(tracks.id.shape[0]):
        tracks.id[j], tracks.status[j], tracks.to_delete[j] = NONE, EMPTY, False


@kernel
def start_track(world, tracker, k, weight, d):
    """A new track on detection d of agent k, in the lowest empty column."""
    j = _free_column(world, tracker)
    if j == NONE:
        world.overflow.dropped_births += 1
        return
    tracks, agents = tracks_of(world, tracker), world.agents
    point, spread = world.reports.detections[k, d], world.parameters.velocity_variance
    kalman.start(tracks.mean[j], tracks.cov[j], point[0], point[1], agents.noise_cov[k], weight, spread)
    tracks.id[j], tracks.status[j], tracks.to_delete[j] = tracks.next_id, TENTATIVE, False
    tracks.next_id += 1
    tracks.count = max(tracks.count, j + 1)
    tracks.score[j], tracks.initial[j], tracks.peak[j] = agents.initial_score[k], agents.initial_score[k], -np.inf
    tracks.age[j], tracks.unseen[j], tracks.window[j] = 0, 0, 0
    tracks.hits[j], tracks.hit_now[j] = 1, True
    if tracker == CENTRAL:
        _credit_birth(world, k, j, d)


@kernel
def _free_column(world, tracker):
    """The lowest empty column; in a full store that of the lowest-scored tentative track, which is evicted; NONE
    if there is none.

    Of equal scores (all tracks born in one frame have theirs from L_0) the oldest gives way, whatever its
    column.
    """
    tracks, weakest, low = tracks_of(world, tracker), NONE, np.inf
    for j in range(tracks.status.shape[0]):
        if tracks.status[j] == EMPTY:
            return j
        older = weakest != NONE and tracks.score[j] == low and tracks.id[j] < tracks.id[weakest]
        if tracks.status[j] == TENTATIVE and (tracks.score[j] < low or older):
            weakest, low = j, tracks.score[j]
    if weakest != NONE:
        world.overflow.evicted_tracks += 1
        _forget_assignments(world, tracker, weakest)
    return weakest


@kernel
def _forget_assignments(world, tracker, j):
    """No detection of this frame may point to the track that was evicted."""
    scan, evidence = world.scan, world.evidence
    for d in range(scan.assignment.shape[0]):
        if scan.assignment[d] == j:
            scan.assignment[d] = EVICTED  # it had a track, so it starts none
    if tracker == CENTRAL:
        for k in range(evidence.assignment.shape[0]):
            for d in range(world.reports.count[k]):
                if evidence.assignment[k, d] == j:
                    evidence.assignment[k, d] = NONE


@kernel
def _credit_birth(world, k, j, d):
    """Who contributed what to a new central track."""
    evidence = world.evidence
    for other in range(evidence.agent_score.shape[0]):
        evidence.agent_score[other, j] = 0.0
        if world.parameters.keep_innovations:
            clear_innovation(world, other, j)
    if world.parameters.keep_predictions:
        clear_prediction(world, j)
    if world.parameters.fusion != SEQUENTIAL:
        world.kept.hits[j] = 0
    evidence.agent_score[k, j] = world.agents.initial_score[k]
    world.scan.gain[j] = 0.0
    world.labels.injected_hits[j] = int(is_injection(world.reports.origin[k, d]))


@kernel
def clear_innovation(world, k, j):
    """Agent k has not hit track j in this frame."""
    evidence = world.evidence
    for a in range(2):
        evidence.innovation[k, j, a] = np.nan
        for b in range(2):
            evidence.innovation_cov[k, j, a, b] = np.nan
    evidence.distance2[k, j] = np.nan


@kernel
def clear_prediction(world, j):
    """Track j was not there when the frame began."""
    evidence = world.evidence
    for a in range(4):
        evidence.predicted_mean[j, a] = np.nan
        for b in range(4):
            evidence.predicted_cov[j, a, b] = np.nan


@kernel
def drop_track(world, tracker, j):
    """Empty a column."""
    tracks = tracks_of(world, tracker)
    tracks.id[j], tracks.status[j], tracks.to_delete[j] = NONE, EMPTY, False
    while tracks.count > 0 and tracks.status[tracks.count - 1] == EMPTY:
        tracks.count -= 1


@kernel
def delete_marked(world, tracker):
    """Empty the columns of the tracks that are to be deleted."""
    tracks = tracks_of(world, tracker)
    for j in range(tracks.count - 1, -1, -1):
        if tracks.status[j] != EMPTY and tracks.to_delete[j]:
            drop_track(world, tracker, j)


@kernel
def list_confirmed(world):
    """List in `scratch.listing` the central columns of confirmed tracks that are not to be deleted; returns how
    many.
    """
    tracks, listed = world.tracks, 0
    for j in range(tracks.count):
        if tracks.status[j] == CONFIRMED and not tracks.to_delete[j]:
            world.scratch.listing[listed] = j
            listed += 1
    return listed
