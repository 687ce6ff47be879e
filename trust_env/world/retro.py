"""The actuation `retro`: once an agent is accused, the centre tracks the last frames again, without its reports.

After the idea of retrospective recovery (Hadjicostis & Dominguez-Garcia 2022). The tracks of the second run are new
ones, so that a defense judges them anew. The reports of an accused agent are ignored until its trust has recovered.
"""

from __future__ import annotations

from trust_env.compiled.kernels import kernel
from trust_env.compiled.structs import CENTRAL
from trust_env.world.evidence import gather_evidence
from trust_env.world.fov import locate_fovs
from trust_env.world.picture import RETRO, clear_track_verdict
from trust_env.world.tracking.track_store import clear_store, delete_marked
from trust_env.world.tracking.tracker import track_centrally


@kernel
def forget_reports(world):
    """An episode begins: nothing kept, nobody accused."""
    retro = world.retro
    retro.frames = 0
    for k in range(retro.frames_below.shape[0]):
        retro.frames_below[k] = 0


@kernel
def track_again(world):
    """Keep the frame's reports; track the last frames again if an agent has just become accused."""
    if world.parameters.actuation == RETRO:
        _keep_frame(world)
        if _accuse(world):
            _run_again(world)


@kernel
def _keep_frame(world):
    """Reports, poses and length of the frame, in place of the oldest ones."""
    retro, reports, pose = world.retro, world.reports, world.agents.pose
    b = retro.frames % retro.kept_dt.shape[0]
    retro.kept_dt[b] = world.clock.dt
    for k in range(pose.shape[0]):
        retro.kept_count[b, k] = reports.count[k]
        for axis in range(3):
            retro.kept_pose[b, k, axis] = pose[k, axis]
        for d in range(reports.count[k]):
            retro.kept_origin[b, k, d] = reports.origin[k, d]
            for axis in range(2):
                retro.kept_detections[b, k, d, axis] = reports.detections[k, d, axis]
    retro.frames += 1


@kernel
def _restore_frame(world, b):
    """The kept frame number b in place of the present one."""
    retro, reports, pose = world.retro, world.reports, world.agents.pose
    world.clock.dt = retro.kept_dt[b]
    for k in range(pose.shape[0]):
        reports.count[k] = retro.kept_count[b, k]
        for axis in range(3):
            pose[k, axis] = retro.kept_pose[b, k, axis]
        for d in range(reports.count[k]):
            reports.origin[k, d] = retro.kept_origin[b, k, d]
            for axis in range(2):
                reports.detections[k, d, axis] = retro.kept_detections[b, k, d, axis]
    locate_fovs(world)


@kernel
def _accuse(world):
    """Weights of the agents, 0 while they are accused; returns whether one has just become so."""
    verdict, retro, parameters, found = world.verdict, world.retro, world.parameters, False
    for k in range(verdict.agent_trust.shape[0]):
        below = verdict.agent_trust[k] < parameters.accuse_below
        retro.frames_below[k] = retro.frames_below[k] + 1 if below else 0
        verdict.agent_weight[k] = 0.0 if retro.frames_below[k] >= parameters.accuse_frames else 1.0
        found |= retro.frames_below[k] == parameters.accuse_frames
    return found


@kernel
def _run_again(world):
    """The central tracker, from nothing, over the kept frames, of which the last one is the present."""
    retro, tracks = world.retro, world.tracks
    kept, next_id = retro.kept_dt.shape[0], tracks.next_id
    clear_store(world, CENTRAL)
    tracks.next_id = next_id
    first = max(0, retro.frames - kept)
    for frame in range(first, retro.frames):
        if frame > first:
            delete_marked(world, CENTRAL)
        _restore_frame(world, frame % kept)
        track_centrally(world)
    gather_evidence(world)
    clear_track_verdict(world)
