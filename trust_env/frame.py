"""A frame: its stages in order, and the one compiled entry that runs them in many worlds.

Every face of the product, the PettingZoo environment, the batch, the fusion centre on recorded detections and
the replay of evidence, calls this entry with the stages that it needs.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from trust_env.compiled.apart import call_apart, kernels_apart
from trust_env.compiled.entry import Entry
from trust_env.compiled.kernels import choose, kernel
from trust_env.compiled.layout import PARAMETERS, ROW, SCRATCH, declare
from trust_env.compiled.structs import CENTRAL, world_at
from trust_env.compiled.threads import share_work
from trust_env.defenses import DEFENSES, BuiltIn
from trust_env.defenses.base import clear_verdict, weigh_agents
from trust_env.spaces.observation import observe
from trust_env.world.agents import place_agents
from trust_env.world.coverage import forget_coverage
from trust_env.world.editing import edit_reports
from trust_env.world.evidence import gather_evidence
from trust_env.world.fields import WORLD_GROUPS
from trust_env.world.fov import locate_fovs
from trust_env.world.picture import draw_picture, publish, remove_distrusted
from trust_env.world.resolution import merge_unresolved
from trust_env.world.retro import forget_reports, track_again
from trust_env.world.reward import compute_rewards
from trust_env.world.scoring import score_picture
from trust_env.world.sensing import sense
from trust_env.world.siap import measure_siap
from trust_env.world.targets import move_targets, place_targets
from trust_env.world.tracking.track_store import clear_store
from trust_env.world.tracking.tracker import track_centrally, track_locally


class Stage:
    """A part of a frame: a kernel that is run in one world after another."""

    def __init__(self, run: Any):
        self.run = run

    @property
    def bit(self) -> int:
        return 1 << FRAME.index(self)


@kernel
def start_episode(world):
    """Empty trackers, nothing reported, no opinion; agents and targets in place."""
    clear_store(world, CENTRAL)
    for k in range(world.agents.role.shape[0]):
        clear_store(world, k)
        world.reports.count[k], world.agents.first_edit[k] = 0, 0
        world.verdict.agent_weight[k] = 1.0
        world.rewards.reward[k], world.rewards.last_agent_trust[k] = 0.0, np.nan
    overflow, world.clock.frame = world.overflow, 0
    overflow.detections, overflow.injections, overflow.unfused_tracks = 0, 0, 0
    overflow.evicted_tracks, overflow.dropped_births = 0, 0
    clear_verdict(world)
    draw_picture(world)
    forget_reports(world)
    if world.parameters.keep_coverage:
        forget_coverage(world)
    place_agents(world)
    place_targets(world)


RESET_DEFENSE, JUDGE_FRAME = range(2)  # the kernels of a built-in defense
OWN_DEFENSE = 0  # the address of a user's own, which has no kernels


@kernel
def reset_defense(world):
    """The built-in defense forgets everything."""
    if world.parameters.defense != OWN_DEFENSE:
        call_apart(world.parameters.defense, RESET_DEFENSE, world)


@kernel
def judge_frame(world):
    """The built-in defense writes its verdict."""
    call_apart(world.parameters.defense, JUDGE_FRAME, world)


START = Stage(start_episode)
FORGET = Stage(reset_defense)
EDIT = Stage(edit_reports)
RESOLVE = Stage(merge_unresolved)
LOCATE = Stage(locate_fovs)
TRACK_LOCALLY = Stage(track_locally)
TRACK_CENTRALLY = Stage(track_centrally)
GATHER_EVIDENCE = Stage(gather_evidence)
CLEAR_VERDICT = Stage(clear_verdict)
JUDGE = Stage(judge_frame)
WEIGH = Stage(weigh_agents)
TRACK_AGAIN = Stage(track_again)
PUBLISH = Stage(publish)
SCORE = Stage(score_picture)
SIAP = Stage(measure_siap)
REWARD = Stage(compute_rewards)
REMOVE = Stage(remove_distrusted)
MOVE = Stage(move_targets)
SENSE = Stage(sense)
OBSERVE = Stage(observe)

# The order in which they run, whichever of them are asked for.
FRAME = (
    START, FORGET,                                                  # where an episode begins
    EDIT, RESOLVE,                                                  # 1: actions edit the raw detections
    LOCATE, TRACK_LOCALLY, TRACK_CENTRALLY, GATHER_EVIDENCE,        # 2: the trackers take the reports
    CLEAR_VERDICT, JUDGE, WEIGH, TRACK_AGAIN, PUBLISH,              # 3: the defense judges, and the picture
    SCORE, SIAP, REWARD, REMOVE,                                    # 4: the picture against the truth
    MOVE, SENSE, OBSERVE,                                           # 5: targets move, agents sense again
)  # fmt: skip


def stages(*wanted: Stage) -> int:
    """Stages as one number, to be joined with `|`."""
    return sum(stage.bit for stage in wanted)


BEGIN = stages(START, FORGET, SENSE, OBSERVE)
SENSE_ONLY = stages(SENSE)
EDIT_AND_TRACK = stages(EDIT, RESOLVE, TRACK_LOCALLY, TRACK_CENTRALLY, GATHER_EVIDENCE)
TRACK_AS_REPORTED = stages(RESOLVE, LOCATE, TRACK_LOCALLY, TRACK_CENTRALLY, GATHER_EVIDENCE)  # as given
JUDGE_BUILT_IN = stages(CLEAR_VERDICT, JUDGE, WEIGH)
JUDGE_NOTHING = stages(CLEAR_VERDICT)
CONCLUDE = stages(TRACK_AGAIN, PUBLISH, REMOVE)
NEXT_FRAME = stages(SCORE, SIAP, REWARD, MOVE, SENSE, OBSERVE)


def declare_defenses() -> None:
    """Give the built-in defenses' parameters and memory a place among the fields, each in a group of its name."""
    for name, defense in DEFENSES.items():
        if name in WORLD_GROUPS:
            raise ValueError(f"a defense cannot be called {name!r}, as fields of the world are")
        declare(name, f"{name}_", PARAMETERS, defense.parameters)
        declare(name, f"{name}_", ROW, defense.memory)
        declare(name, f"{name}_", SCRATCH, defense.scratch)


@functools.cache
def defense_entry(defense: type[BuiltIn]) -> Entry:
    """A built-in defense's kernels, which are compiled for those who use it: their address is what the
    parameter `defense` says.
    """
    return kernels_apart(f"{defense.__module__}.{defense.__name__}", (defense.reset, defense.judge))


@functools.cache
def engine() -> Entry:
    """The entry that runs stages in worlds: `(shared, thread, stages, patience)`, see `share_work`."""
    run_stage, number_of_stages = choose([stage.run for stage in FRAME], "world"), len(FRAME)

    @kernel
    def run_worlds(own, first, last, wanted):
        for stage in range(number_of_stages):
            if (wanted >> stage) & 1:  # over all worlds: a stage's code stays in the instruction cache
                for w in range(first, last):
                    world = world_at(own[0] + w * own[1], own[2], own[3], own[4] + w * own[5], own[6])
                    if world.clock.active != 0:
                        run_stage(stage, world)

    return share_work(run_worlds, len(OWN))


# What each thread is told of the worlds.
OWN = ("rows", "row_bytes", "parameters", "scratch", "actions", "action_bytes", "layout")
