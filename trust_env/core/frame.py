"""One frame of the world, in order. The stages between these two, judging and scoring, stand in `trust_env/engine.py`."""

from __future__ import annotations

from trust_env.core.edit import edit_reports
from trust_env.core.evidence import gather_evidence
from trust_env.core.jit import compiled
from trust_env.core.layout import F, flags1, floats1, floats2, ints1, ints2, shape0, whole
from trust_env.core.motion import move_targets, place_targets
from trust_env.core.sensing import place_agents, sense
from trust_env.core.tracker import (
    CENTRAL,
    EMPTY,
    IGNORED_WEIGHT,
    _clear_innovation,
    central_tracker,
    clear_tracker,
    drop_doomed,
    end_frame,
    local_tracker,
    predict_tracks,
    scan,
)


@compiled
def start_episode(world):
    """Empty trackers, agents and targets in place, and the first look."""
    clear_tracker(central_tracker(world))
    for k in range(shape0(world, F.pose)):
        clear_tracker(local_tracker(world, k))
        ints1(world, F.report_count)[k] = 0
        floats1(world, F.agent_weight)[k] = 1.0
    ints1(world, F.frame)[0] = 0
    for counter in range(4):
        ints1(world, F.overflow)[counter] = 0
    place_agents(world)
    place_targets(world)
    sense(world, 0)


@compiled
def edit_and_track(world):
    """Steps 1 and 2: reports, local trackers, central tracker, evidence."""
    edit_reports(world)
    track(world)


@compiled
def track(world):
    """Step 2 alone, on the reports as they stand."""
    for k in range(shape0(world, F.pose)):
        local = local_tracker(world, k)
        predict_tracks(world, local)
        scan(world, local, k, 1.0)
        end_frame(world, local)
        drop_doomed(local)
    central = central_tracker(world)
    predict_tracks(world, central)
    if whole(world, F.full_evidence):
        for k in range(shape0(world, F.pose)):
            for j in range(central.columns[0]):
                _clear_innovation(world, k, j)
    for k in range(shape0(world, F.pose)):
        _take_report(world, central, k)
    end_frame(world, central)
    gather_evidence(world)


@compiled
def _take_report(world, central, k):
    """The central tracker takes agent k's report, and the books are kept on who contributed what."""
    assignment, of_scan = ints2(world, F.assignment), ints1(world, F.scan_assignment)
    detections, weight = ints1(world, F.report_count)[k], floats1(world, F.agent_weight)[k]
    if weight < IGNORED_WEIGHT:
        for d in range(detections):
            assignment[k, d] = -1
        return
    scan(world, central, k, weight)
    gain, agent_score, injected = (
        floats1(world, F.scan_gain),
        floats2(world, F.agent_score),
        ints1(world, F.track_injected_hits),
    )
    for j in range(central.columns[0]):
        agent_score[k, j] += gain[j]
    for d in range(detections):
        assignment[k, d] = max(of_scan[d], -1)
        if of_scan[d] >= 0 and ints2(world, F.report_origin)[k, d] <= -2:
            injected[of_scan[d]] += 1


@compiled
def delete_tracks(world):
    """Delete what the tracker gave up, unless the defense keeps it."""
    keep, doomed = flags1(world, F.keep), flags1(world, F.track_doomed)
    central = central_tracker(world)
    for j in range(central.columns[0]):
        if central.status[j] != EMPTY and doomed[j] and keep[j]:
            doomed[j] = False
    drop_doomed(central)


@compiled
def move_and_sense(world):
    """Step 5: the next frame begins."""
    ints1(world, F.frame)[0] += 1
    frame = whole(world, F.frame)
    move_targets(world, frame)
    sense(world, frame)
