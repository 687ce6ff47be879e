"""The world's own stages of a frame.

`trust_env/engine.py` runs them in order, with judging and scoring between them.
"""

from __future__ import annotations

from trust_env.compiled.jit import compiled
from trust_env.world.fields import F, flags1, floats1, floats2, ints1, ints2, shape0, whole
from trust_env.world.sensing import place_agents, sense
from trust_env.world.targets import move_targets, place_targets
from trust_env.world.tracking.track_store import (
    CENTRAL,
    clear_innovation,
    clear_store,
    drop_doomed,
    n_columns,
)
from trust_env.world.tracking.tracker import IGNORED_WEIGHT, end_frame, predict_tracks, scan


@compiled
def start_episode(world):
    """Empty trackers, agents and targets in place, and the first look."""
    clear_store(world, CENTRAL)
    for k in range(shape0(world, F.pose)):
        clear_store(world, k)
        ints1(world, F.report_count)[k] = 0
        floats1(world, F.agent_weight)[k] = 1.0
    ints1(world, F.frame)[0] = 0
    for counter in range(4):
        ints1(world, F.overflow)[counter] = 0
    place_agents(world)
    place_targets(world)
    sense(world, 0)


@compiled
def track_locally(world):
    """Step 2, first half: every agent's own tracker takes its report."""
    for k in range(shape0(world, F.pose)):
        predict_tracks(world, k)
        scan(world, k, k, 1.0)
        end_frame(world, k)
        drop_doomed(world, k)


@compiled
def track_centrally(world):
    """Step 2, second half: the central tracker takes the reports, agent by agent."""
    agents = shape0(world, F.pose)
    predict_tracks(world, CENTRAL)
    if whole(world, F.full_evidence):
        for k in range(agents):
            for j in range(n_columns(world, CENTRAL)):
                clear_innovation(world, k, j)
    for k in range(agents):
        _take_report(world, k)
    end_frame(world, CENTRAL)


@compiled
def _take_report(world, k):
    """The central tracker takes agent k's report, and the books are kept on who contributed what."""
    assignment, of_scan = ints2(world, F.assignment), ints1(world, F.scan_assignment)
    detections, weight = ints1(world, F.report_count)[k], floats1(world, F.agent_weight)[k]
    if weight < IGNORED_WEIGHT:
        for d in range(detections):
            assignment[k, d] = -1
        return
    scan(world, CENTRAL, k, weight)
    gain, agent_score, injected = (
        floats1(world, F.scan_gain),
        floats2(world, F.agent_score),
        ints1(world, F.track_injected_hits),
    )
    for j in range(n_columns(world, CENTRAL)):
        agent_score[k, j] += gain[j]
    for d in range(detections):
        assignment[k, d] = max(of_scan[d], -1)
        if of_scan[d] >= 0 and ints2(world, F.report_origin)[k, d] <= -2:
            injected[of_scan[d]] += 1


@compiled
def delete_tracks(world):
    """Delete what the tracker gave up, unless the defense keeps it."""
    keep, doomed = flags1(world, F.keep), flags1(world, F.track_doomed)
    for j in range(n_columns(world, CENTRAL)):
        doomed[j] = doomed[j] and not keep[j]
    drop_doomed(world, CENTRAL)


@compiled
def begin_frame(world):
    """Step 5, first half: targets move, leave and are born."""
    ints1(world, F.frame)[0] += 1
    move_targets(world, whole(world, F.frame))
