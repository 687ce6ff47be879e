"""The engine: the stages of a frame chained into one kernel, run over a range of worlds.

Every face of the product, the PettingZoo environment, the batch, the fusion centre on recorded detections and
the replay of evidence, calls this kernel with the stages that it needs.
"""

from __future__ import annotations

import numpy as np

from trust_env.compiled import atomic
from trust_env.compiled.cache import NativeKernel
from trust_env.compiled.jit import compiled
from trust_env.defenses.base import clear_verdict
from trust_env.defenses.majority import judge_majority, reset_majority
from trust_env.defenses.trust import judge_trust, reset_trust
from trust_env.spaces.observation import observe
from trust_env.world.editing import edit_reports
from trust_env.world.evidence import gather_evidence
from trust_env.world.fields import F, World, flags1, floats1, ints1, ints_at, whole
from trust_env.world.reward import pay
from trust_env.world.scoring import REMOVE as REMOVE_DISTRUSTED
from trust_env.world.scoring import WEIGHT, publish_picture, score_picture
from trust_env.world.sensing import locate_fovs, sense
from trust_env.world.stages import begin_frame, delete_tracks, start_episode, track_centrally, track_locally
from trust_env.world.tracking.score import CONFIRMED
from trust_env.world.tracking.track_store import CENTRAL, drop_track, n_columns

# A frame's stages, in order; combined as bits.
START, EDIT, LOCATE, LOCAL, CENTRE, EVIDENCE, JUDGE, PUBLISH, SCORE, PAY, REMOVE, MOVE, SENSE, OBSERVE = (
    1 << bit for bit in range(14)
)
RESET = START | OBSERVE
EDIT_AND_TRACK = EDIT | LOCAL | CENTRE | EVIDENCE
TRACK = LOCATE | LOCAL | CENTRE | EVIDENCE  # on reports and poses as they stand
CONCLUDE = PUBLISH | REMOVE
NEXT = SCORE | PAY | MOVE | SENSE | OBSERVE
STEP = EDIT_AND_TRACK | JUDGE | CONCLUDE | NEXT
TRUST_CODE, MAJORITY_CODE = 1, 2


@compiled
def _start(world):
    start_episode(world)
    if whole(world, F.defense) == TRUST_CODE:
        reset_trust(world)
    elif whole(world, F.defense) == MAJORITY_CODE:
        reset_majority(world)
    clear_verdict(world)
    publish_picture(world)
    for k in range(floats1(world, F.last_agent_trust).shape[0]):
        floats1(world, F.last_agent_trust)[k] = np.nan
        floats1(world, F.reward)[k] = 0.0
    for m in range(floats1(world, F.metrics).shape[0]):
        floats1(world, F.metrics)[m] = 0.0


@compiled
def _judge(world):
    """Step 3, for the built-in defenses."""
    clear_verdict(world)
    if whole(world, F.defense) == TRUST_CODE:
        judge_trust(world)
    elif whole(world, F.defense) == MAJORITY_CODE:
        judge_majority(world)
    trust, weight = floats1(world, F.agent_trust), floats1(world, F.agent_weight)
    for k in range(trust.shape[0]):
        weight[k] = 1.0 if np.isnan(trust[k]) else trust[k]


@compiled
def _publish(world):
    """The verdict takes effect: deletions, the picture; `remove` and `weight` act on the next frame only."""
    delete_tracks(world)
    publish_picture(world)
    if whole(world, F.actuation) != WEIGHT:
        weight = floats1(world, F.agent_weight)
        for k in range(weight.shape[0]):
            weight[k] = 1.0


@compiled
def _remove_distrusted(world):
    """`remove`: confirmed tracks that are not fit for publication leave the tracker, after the frame has been
    scored.
    """
    if whole(world, F.actuation) != REMOVE_DISTRUSTED:
        return
    status, publish = ints1(world, F.track_status), flags1(world, F.publish)
    for j in range(n_columns(world, CENTRAL) - 1, -1, -1):
        if status[j] == CONFIRMED and not publish[j]:
            drop_track(world, CENTRAL, j)


@compiled
def _run_stage(world, stage):
    """One stage of a frame, in one world."""
    if stage == START:
        _start(world)
    elif stage == EDIT:
        edit_reports(world)
    elif stage == LOCATE:
        locate_fovs(world)
    elif stage == LOCAL:
        track_locally(world)
    elif stage == CENTRE:
        track_centrally(world)
    elif stage == EVIDENCE:
        gather_evidence(world)
    elif stage == JUDGE:
        _judge(world)
    elif stage == PUBLISH:
        _publish(world)
    elif stage == SCORE:
        score_picture(world)
    elif stage == PAY:
        pay(world)
    elif stage == REMOVE:
        _remove_distrusted(world)
    elif stage == MOVE:
        begin_frame(world)
    elif stage == SENSE:
        sense(world, whole(world, F.frame))
    elif stage == OBSERVE:
        observe(world)


# What the threads of a crew share, int64[BATCHES + 5 threads]: what is to be done and how far it is; then,
# for each, where rows uint8[W, ·] begin and how long they are, and where params, scratch and layout begin.
STAGES, WORLDS, THREADS, LEAST, MOST, TAKEN, DONE, BATCHES = range(8)
BATCH = 5


@compiled
def _run_worlds(batch, first, last, stages):
    stage = START
    while stage <= OBSERVE:  # stage by stage over all worlds: a stage's code stays in the instruction cache
        if stages & stage:
            for w in range(first, last):
                world = World(batch[0] + w * batch[1], batch[2], batch[3], batch[4])
                if ints1(world, F.active)[0] != 0:
                    _run_stage(world, stage)
        stage <<= 1


def _advance(crew, thread, stages, patience):
    orders = ints_at(crew, BATCHES)
    batch, waited = ints_at(crew + 8 * (BATCHES + BATCH * thread), BATCH), 0
    if stages != 0:
        orders[STAGES] = stages
        atomic.store(crew + 8 * DONE, 0)
        atomic.store(crew + 8 * TAKEN, 0)
    while waited < patience:
        left = orders[WORLDS] - atomic.load(crew + 8 * TAKEN)
        if left > 0:
            # Ever fewer worlds at a time, so that no thread waits long for another (guided self-scheduling,
            # Polychronopoulos & Kuck 1987).
            share = max(orders[LEAST], min(orders[MOST], left // (2 * orders[THREADS])))
            first = atomic.add(crew + 8 * TAKEN, share)
            last = min(first + share, orders[WORLDS])
            if first < last:
                _run_worlds(batch, first, last, orders[STAGES])
                atomic.add(crew + 8 * DONE, last - first)
            waited = 0
        elif thread == 0 and atomic.load(crew + 8 * DONE) == orders[WORLDS]:
            return
        else:
            atomic.pause()
            waited += 1


advance = NativeKernel(_advance)
"""advance(crew, thread, stages, patience): one thread's part in running stages of a frame in all worlds.

Thread 0 gives the `stages`, takes part, and returns when all worlds are done; the others (stages 0) take part
in frame after frame. Either gives up when it has waited in vain for `patience` turns.
"""
