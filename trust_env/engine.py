"""The engine: the stages of a frame chained into one kernel, run over a range of worlds.

Every face of the product, the PettingZoo environment, the batch, the fusion centre on recorded detections and
the replay of evidence, calls this kernel with the stages that it needs.
"""

from __future__ import annotations

import numpy as np

from trust_env.core.edit import edit_reports
from trust_env.core.evidence import gather_evidence
from trust_env.core.frame import begin_frame, delete_tracks, start_episode, track_centrally, track_locally
from trust_env.core.jit import compiled
from trust_env.core.layout import F, World, flags1, floats1, ints1, ints_at, whole
from trust_env.core.native import NativeKernel
from trust_env.core.outcome import REMOVE as REMOVE_DISTRUSTED
from trust_env.core.outcome import WEIGHT, publish_picture, score_picture
from trust_env.core.score import CONFIRMED
from trust_env.core.sensing import locate_fovs, sense
from trust_env.core.store import CENTRAL, drop_track, n_columns
from trust_env.defenses.majority import judge_majority, reset_majority
from trust_env.defenses.trust import judge_trust, reset_trust
from trust_env.defenses.verdict import clear_verdict
from trust_env.observation import observe
from trust_env.reward import pay

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


def _advance(batch, first, last, stages):
    addresses, stage = ints_at(batch, 5), START
    rows, row_bytes, params, scratch, layout = (
        addresses[0],
        addresses[1],
        addresses[2],
        addresses[3],
        addresses[4],
    )
    while stage <= OBSERVE:  # stage by stage over all worlds: a stage's code stays in the instruction cache
        if stages & stage:
            for w in range(first, last):
                world = World(rows + w * row_bytes, params, scratch, layout)
                if ints1(world, F.active)[0] != 0:
                    _run_stage(world, stage)
        stage <<= 1


advance = NativeKernel(_advance)
"""advance(batch, first, last, stages): worlds first to last - 1 of a batch.

batch is the address of five int64: where rows uint8[W, ·] begin and how long they are, where params uint8[·],
scratch uint8[·] and layout int64[·, 6] begin.
"""
