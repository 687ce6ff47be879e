"""Step 4 of a frame: the picture against the truth.

A track is *false* when it is assigned to no target within `match_distance`; a target is *missing* when at
least one FOV holds it and no track of the picture is assigned to it.
"""

from __future__ import annotations

import math

from trust_env.compiled.jit import compiled, inlined
from trust_env.world.fields import F, flags1, floats1, floats2, ints1, real, shape0, whole
from trust_env.world.fov import contains
from trust_env.world.tracking.association import NONE, assign, most_pairs_then_least_cost
from trust_env.world.tracking.score import CONFIRMED

MONITOR, FILTER, REMOVE, WEIGHT = 0, 1, 2, 3
ACTUATIONS = {"monitor": MONITOR, "filter": FILTER, "remove": REMOVE, "weight": WEIGHT}
(
    FALSE_TRACKS,
    INJECTED_TRACKS,
    MISSING_TARGETS,
    VISIBLE_TARGETS,
    PUBLISHED_TRACKS,
    GOSPA,
    OSPA,
    LOCALISATION,
) = range(8)


@compiled
def publish_picture(world):
    """`published[J]`: what the picture shows."""
    status, publish, published = (
        ints1(world, F.track_status),
        flags1(world, F.publish),
        flags1(world, F.published),
    )
    everything = whole(world, F.actuation) == MONITOR
    for j in range(published.shape[0]):
        published[j] = j < whole(world, F.columns) and status[j] == CONFIRMED and (everything or publish[j])


@compiled
def score_picture(world):
    """Fill `metrics`, and label every confirmed track with its target (`track_label`, -1: false) and its
    maker (`track_injected`).
    """
    metrics, published, track_target = (
        floats1(world, F.metrics),
        flags1(world, F.published),
        ints1(world, F.track_target),
    )
    _freeze_truth(world)
    _match_tracks(world, False)
    _label_makers(world)
    labels = ints1(world, F.track_label)
    for j in range(whole(world, F.columns)):
        labels[j] = track_target[j]
        flags1(world, F.judged_confirmed)[j] = ints1(world, F.track_status)[j] == CONFIRMED
    for j in range(whole(world, F.columns), labels.shape[0]):
        flags1(world, F.judged_confirmed)[j] = False
    if not _shows_everything(world):
        _match_tracks(world, True)
    shown = found = false = injected = visible = 0
    for j in range(whole(world, F.columns)):
        if published[j]:
            shown += 1
            found += track_target[j] != NONE and flags1(world, F.judged_visible)[track_target[j]]
            false += track_target[j] == NONE
            injected += track_target[j] == NONE and flags1(world, F.track_injected)[j]
    for n in range(shape0(world, F.judged_visible)):
        visible += flags1(world, F.judged_visible)[n]
    metrics[FALSE_TRACKS], metrics[INJECTED_TRACKS], metrics[MISSING_TARGETS] = (
        false,
        injected,
        visible - found,
    )
    metrics[VISIBLE_TARGETS], metrics[PUBLISHED_TRACKS] = visible, shown
    _measure_picture(world)


@compiled
def _shows_everything(world):
    """Whether the picture is all confirmed tracks."""
    for j in range(whole(world, F.columns)):
        if ints1(world, F.track_status)[j] == CONFIRMED and not flags1(world, F.published)[j]:
            return False
    return True


@compiled
def _freeze_truth(world):
    """Remember the truth that the picture is scored against, and which targets at least one FOV holds."""
    alive, state = flags1(world, F.target_alive), floats2(world, F.target_state)
    judged, judged_state, visible = (
        flags1(world, F.judged_alive),
        floats2(world, F.judged_state),
        flags1(world, F.judged_visible),
    )
    for n in range(alive.shape[0]):
        judged[n], visible[n] = alive[n], False
        for axis in range(4):
            judged_state[n, axis] = state[n, axis]
        for k in range(shape0(world, F.pose)):
            visible[n] |= alive[n] & contains(world, k, state[n, 0], state[n, 1])


@compiled
def _match_tracks(world, picture_only):
    """`track_target[J]`: one-to-one assignment of tracks (confirmed, or of the picture only) to targets
    within the match distance.
    """
    start, pair_column, cost = (
        ints1(world, F.pair_start),
        ints1(world, F.pair_column),
        floats1(world, F.pair_cost),
    )
    status, published, mean = (
        ints1(world, F.track_status),
        flags1(world, F.published),
        floats2(world, F.track_mean),
    )
    alive, state, track_target = (
        flags1(world, F.judged_alive),
        floats2(world, F.judged_state),
        ints1(world, F.track_target),
    )
    rows, reach, pairs = ints1(world, F.listing), real(world, F.match_distance), 0
    listed = 0
    for j in range(whole(world, F.columns)):
        track_target[j] = NONE
        if not (published[j] if picture_only else status[j] == CONFIRMED):
            continue
        start[listed] = pairs
        for n in range(alive.shape[0]):
            dx, dy = mean[j, 0] - state[n, 0], mean[j, 1] - state[n, 1]
            squared = dx * dx + dy * dy
            pair_column[pairs], cost[pairs] = n, squared
            pairs += int(alive[n] & (squared <= reach * reach))
        rows[listed] = j
        listed += 1
    start[listed] = pairs
    for p in range(pairs):
        cost[p] = math.sqrt(cost[p])
    most_pairs_then_least_cost(world, listed, alive.shape[0])
    for r in range(listed):
        track_target[rows[r]] = ints1(world, F.row_column)[r]


@compiled
def _label_makers(world):
    """`track_injected[J]`: more of the track's hits were injections than not."""
    hits, from_injections, injected = (
        ints1(world, F.track_hits),
        ints1(world, F.track_injected_hits),
        flags1(world, F.track_injected),
    )
    for j in range(whole(world, F.columns)):
        injected[j] = 2 * from_injections[j] > hits[j]


@compiled
def _measure_picture(world):
    """GOSPA and OSPA of the picture against the targets that a FOV holds or a track of the picture is
    assigned to.
    """
    estimates, truths, metrics = (
        floats2(world, F.estimates),
        floats2(world, F.truths),
        floats1(world, F.metrics),
    )
    published, mean, state = (
        flags1(world, F.published),
        floats2(world, F.track_mean),
        floats2(world, F.judged_state),
    )
    visible, done, track_target = (
        flags1(world, F.judged_visible),
        flags1(world, F.done),
        ints1(world, F.track_target),
    )
    n_estimates = n_truths = 0
    for n in range(visible.shape[0]):
        done[n] = visible[n]
    for j in range(whole(world, F.columns)):
        if published[j]:
            estimates[n_estimates, 0], estimates[n_estimates, 1] = mean[j, 0], mean[j, 1]
            n_estimates += 1
            if track_target[j] != NONE:
                done[track_target[j]] = True
    for n in range(visible.shape[0]):
        if done[n]:
            truths[n_truths, 0], truths[n_truths, 1] = state[n, 0], state[n, 1]
            n_truths += 1
    cutoff, order = real(world, F.cutoff), real(world, F.order)
    metrics[GOSPA], metrics[OSPA], metrics[LOCALISATION], _ = set_distances(
        world, n_estimates, n_truths, cutoff, order
    )


@inlined
def _root(value, order):
    return math.sqrt(value) if order == 2.0 else value ** (1.0 / order)


@compiled
def set_distances(world, n_estimates, n_truths, cutoff, order):
    """GOSPA with α = 2 (Rahmathullah, García-Fernández & Svensson 2017, Prop. 1) and OSPA (Schuhmacher, Vo &
    Vo 2008) of two sets of points.

    Both minimise Σ min(d, c)^p over assignments. Points in `estimates[·, 2]` and `truths[·, 2]`. Returns
    GOSPA, OSPA, the localisation part of GOSPA^p, and the number of pairs assigned within the cutoff.
    """
    start, pair_column, cost = (
        ints1(world, F.pair_start),
        ints1(world, F.pair_column),
        floats1(world, F.pair_cost),
    )
    estimates, truths = floats2(world, F.estimates), floats2(world, F.truths)
    limit, pairs = cutoff**order, 0
    for r in range(n_estimates):
        start[r] = pairs
        for c in range(n_truths):
            dx, dy = estimates[r, 0] - truths[c, 0], estimates[r, 1] - truths[c, 1]
            squared = dx * dx + dy * dy
            pair_column[pairs], cost[pairs] = c, squared
            pairs += int(squared < cutoff * cutoff)
    start[n_estimates] = pairs
    if order != 2.0:
        for p in range(pairs):
            cost[p] **= 0.5 * order
    assign(world, n_estimates, n_truths, limit)
    assigned, localisation = 0, 0.0
    row_column = ints1(world, F.row_column)
    for r in range(n_estimates):
        for p in range(start[r], start[r + 1]):
            if pair_column[p] == row_column[r]:
                assigned += 1
                localisation += cost[p]
    unassigned = n_estimates + n_truths - 2 * assigned
    gospa = _root(localisation + 0.5 * limit * unassigned, order)
    most = max(n_estimates, n_truths)
    ospa = _root((localisation + limit * (most - assigned)) / most, order) if most > 0 else 0.0
    return gospa, ospa, localisation, assigned
