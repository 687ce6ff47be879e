"""The picture by the single integrated air picture (SIAP) measures that need no identities: sums of a frame.

A track is *associated* with the nearest target within the match distance; other than in `scoring`, several tracks
may be associated with one target (Votruba et al. 2001, as in Stone Soup's `SIAPMetrics`).
"""

from __future__ import annotations

import math

from trust_env.compiled.kernels import inlined, kernel
from trust_env.world.tracking.association import NONE


@kernel
def measure_siap(world):
    """Fill `siap_targets`, `siap_tracked_targets`, `siap_tracks` and the two sums of errors of the frame."""
    scored, metrics, counted = world.scored, world.metrics, world.scratch.counted
    targets = tracked = tracks = 0
    position = velocity = 0.0
    for n in range(scored.visible.shape[0]):
        counted[n] = False
    for j in range(world.tracks.count):
        n = _nearest_target(world, j) if world.picture.published[j] else NONE
        if n != NONE:
            position += math.sqrt(_squared_distance(world, j, n, 0))
            velocity += math.sqrt(_squared_distance(world, j, n, 2))
            tracked += not counted[n]
            tracks += 1
            counted[n] = True
    for n in range(scored.visible.shape[0]):
        targets += scored.visible[n] | counted[n]
    metrics.siap_targets, metrics.siap_tracked_targets, metrics.siap_tracks = targets, tracked, tracks
    metrics.siap_position_error, metrics.siap_velocity_error = position, velocity


@kernel
def _nearest_target(world, j):
    """The target nearest to track j, of equally near ones the first; NONE: none lies within the match distance."""
    alive, reach, nearest, least = world.scored.alive, world.parameters.match_distance, NONE, math.inf
    for n in range(alive.shape[0]):
        squared = _squared_distance(world, j, n, 0)
        if alive[n] and squared <= reach * reach and squared < least:
            nearest, least = n, squared
    return nearest


@inlined
def _squared_distance(world, j, n, first):
    """Of track j from target n: of the positions (first 0, m²) or of the velocities (first 2, m²/s²)."""
    dx = world.tracks.mean[j, first] - world.scored.state[n, first]
    dy = world.tracks.mean[j, first + 1] - world.scored.state[n, first + 1]
    return dx * dx + dy * dy
