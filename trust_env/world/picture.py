"""What becomes of a verdict: which tracks are deleted, which the centre publishes, which leave the tracker."""

from __future__ import annotations

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.compiled.structs import CENTRAL
from trust_env.world.tracking.score import CONFIRMED
from trust_env.world.tracking.track_store import delete_marked, drop_track

MONITOR, FILTER, REMOVE, WEIGHT, RETRO = range(5)
ACTUATIONS = {"monitor": MONITOR, "filter": FILTER, "remove": REMOVE, "weight": WEIGHT, "retro": RETRO}


@kernel
def clear_track_verdict(world):
    """No opinion of any track, every confirmed one fit for publication, nothing kept."""
    tracks, verdict = world.tracks, world.verdict
    for j in range(tracks.count):
        verdict.track_trust[j], verdict.track_trust_var[j], verdict.keep[j] = np.nan, np.nan, False
        verdict.publish[j] = tracks.status[j] == CONFIRMED and not tracks.to_delete[j]


@kernel
def publish(world):
    """Delete what the tracker gave up and the defense does not keep; then the picture. `weight` and `retro` act on
    the next frame, too.
    """
    tracks, verdict = world.tracks, world.verdict
    for j in range(tracks.count):
        tracks.to_delete[j] = tracks.to_delete[j] and not verdict.keep[j]
    delete_marked(world, CENTRAL)
    draw_picture(world)
    if world.parameters.actuation != WEIGHT and world.parameters.actuation != RETRO:
        for k in range(verdict.agent_weight.shape[0]):
            verdict.agent_weight[k] = 1.0


@kernel
def draw_picture(world):
    """`published[J]`: what the picture shows."""
    tracks, published = world.tracks, world.picture.published
    everything = world.parameters.actuation == MONITOR
    for j in range(published.shape[0]):
        confirmed = j < tracks.count and tracks.status[j] == CONFIRMED
        published[j] = confirmed and (everything or world.verdict.publish[j])


@kernel
def remove_distrusted(world):
    """`remove`: confirmed tracks that are not fit for publication leave the tracker, after the frame has been
    scored.
    """
    if world.parameters.actuation != REMOVE:
        return
    tracks = world.tracks
    for j in range(tracks.count - 1, -1, -1):
        if tracks.status[j] == CONFIRMED and not world.verdict.publish[j]:
            drop_track(world, CENTRAL, j)
