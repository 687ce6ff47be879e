"""Step 4 of a frame: the picture against the truth.

A track is *false* when it is assigned to no target within `match_distance`; a target is *missing* when at
least one FOV holds it and no track of the picture is assigned to it.
"""

from __future__ import annotations

import math

from trust_env.compiled.kernels import kernel
from trust_env.world.editing import is_adversary
from trust_env.world.fov import contains
from trust_env.world.point_sets import set_distances
from trust_env.world.tracking.association import NONE, max_cardinality_assignment
from trust_env.world.tracking.score import CONFIRMED


@kernel
def score_picture(world):
    """Fill `metrics`, and label every confirmed track with its target (`label`, NONE: false)."""
    tracks, labels = world.tracks, world.labels
    _keep_truth(world)
    _count_watchers(world)
    _match_tracks(world, False)
    _flag_injected_tracks(world)
    for j in range(labels.label.shape[0]):
        there = j < tracks.count
        labels.label[j] = labels.target[j] if there else labels.label[j]
        world.scored.confirmed[j] = there and tracks.status[j] == CONFIRMED
    if not _shows_everything(world):
        _match_tracks(world, True)
    _count(world)
    _measure_distances(world)


@kernel
def _count(world):
    """What the picture shows, and what it lacks."""
    labels, scored = world.labels, world.scored
    shown = false = injected = visible = missing = 0
    for n in range(scored.visible.shape[0]):
        scored.missing[n] = scored.visible[n]
    for j in range(world.tracks.count):
        if world.picture.published[j]:
            is_false = labels.target[j] == NONE
            shown += 1
            false += is_false
            injected += is_false and labels.injected[j]
            if not is_false:
                scored.missing[labels.target[j]] = False
    for n in range(scored.visible.shape[0]):
        visible += scored.visible[n]
        missing += scored.missing[n]
    metrics = world.metrics
    metrics.false_tracks, metrics.injected_tracks, metrics.published_tracks = false, injected, shown
    metrics.missing_targets, metrics.visible_targets = missing, visible


@kernel
def _shows_everything(world):
    """Whether the picture is all confirmed tracks."""
    for j in range(world.tracks.count):
        if world.tracks.status[j] == CONFIRMED and not world.picture.published[j]:
            return False
    return True


@kernel
def _keep_truth(world):
    """Keep the truth that the picture is scored against, and by how many FOVs it is held."""
    targets, scored = world.targets, world.scored
    for n in range(targets.alive.shape[0]):
        scored.alive[n], scored.watchers[n, 0], scored.watchers[n, 1] = targets.alive[n], 0, 0
        for axis in range(4):
            scored.state[n, axis] = targets.state[n, axis]
        for k in range(world.agents.role.shape[0]):
            inside = contains(world, k, targets.state[n, 0], targets.state[n, 1])
            scored.watchers[n, int(not is_adversary(world, k))] += targets.alive[n] & inside
        scored.visible[n] = scored.watchers[n, 0] + scored.watchers[n, 1] > 0


@kernel
def _count_watchers(world):
    """`watchers[J, 2]`: how many adversaries and benign agents are expected to see each track."""
    expected, watchers, count = world.evidence.expected, world.labels.watchers, world.tracks.count
    for j in range(count):
        watchers[j, 0], watchers[j, 1] = 0, 0
    for k in range(expected.shape[0]):
        side = int(not is_adversary(world, k))
        for j in range(count):
            watchers[j, side] += expected[k, j]


@kernel
def _match_tracks(world, picture_only):
    """`target[J]`: one-to-one assignment of tracks (confirmed, or of the picture only) to targets within the
    match distance.
    """
    tracks, scored, pairs, rows = world.tracks, world.scored, world.pairs, world.scratch.listing
    labels, reach, listed, found = world.labels, world.parameters.match_distance, 0, 0
    for j in range(tracks.count):
        labels.target[j] = NONE
        if not (world.picture.published[j] if picture_only else tracks.status[j] == CONFIRMED):
            continue
        pairs.start[listed] = found
        for n in range(scored.alive.shape[0]):
            dx, dy = tracks.mean[j, 0] - scored.state[n, 0], tracks.mean[j, 1] - scored.state[n, 1]
            squared = dx * dx + dy * dy
            pairs.column[found], pairs.cost[found] = n, squared
            found += int(scored.alive[n] & (squared <= reach * reach))
        rows[listed] = j
        listed += 1
    pairs.start[listed] = found
    for p in range(found):
        pairs.cost[p] = math.sqrt(pairs.cost[p])
    max_cardinality_assignment(world, listed, scored.alive.shape[0])
    for r in range(listed):
        labels.target[rows[r]] = world.matching.row_column[r]


@kernel
def _flag_injected_tracks(world):
    """`injected[J]`: more of the track's hits were injections than not."""
    labels = world.labels
    for j in range(world.tracks.count):
        labels.injected[j] = 2 * labels.injected_hits[j] > world.tracks.hits[j]


@kernel
def _measure_distances(world):
    """GOSPA and OSPA of the picture against the targets that a FOV holds or a track of the picture is
    assigned to.
    """
    scored, scratch, tracks, metrics = world.scored, world.scratch, world.tracks, world.metrics
    n_estimates = n_truths = 0
    for n in range(scored.visible.shape[0]):
        scratch.counted[n] = scored.visible[n]
    for j in range(tracks.count):
        if world.picture.published[j]:
            for axis in range(2):
                scratch.estimates[n_estimates, axis] = tracks.mean[j, axis]
            n_estimates += 1
            if world.labels.target[j] != NONE:
                scratch.counted[world.labels.target[j]] = True
    for n in range(scored.visible.shape[0]):
        if scratch.counted[n]:
            for axis in range(2):
                scratch.truths[n_truths, axis] = scored.state[n, axis]
            n_truths += 1
    cutoff, order = world.parameters.cutoff, world.parameters.order
    metrics.gospa, metrics.ospa, metrics.gospa_localisation, assigned = set_distances(
        world, n_estimates, n_truths, cutoff, order
    )
    unpaired = 0.5 * cutoff**order
    metrics.gospa_missed, metrics.gospa_false = unpaired * (n_truths - assigned), unpaired * (n_estimates - assigned)
