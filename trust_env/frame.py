"""A frame: its stages in order, and the one compiled entry that runs them in many worlds.

Every face of the product, the PettingZoo environment, the batch, the fusion centre on recorded detections and
the replay of evidence, calls this entry with the stages that it needs.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

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
from trust_env.world.reward import compute_rewards
from trust_env.world.scoring import score_picture
from trust_env.world.sensing import sense
from trust_env.world.targets import move_targets, place_targets
from trust_env.world.tracking.track_store import clear_store
from trust_env.world.tracking.tracker import track_centrally, track_locally


class Stage:
    """A part of a frame, run in one world after another: a kernel, or that of this name of the world's defense."""

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
        world.reports.count[k] = 0
        world.verdict.agent_weight[k] = 1.0
        world.rewards.reward[k], world.rewards.last_agent_trust[k] = 0.0, np.nan
    overflow, world.clock.frame = world.overflow, 0
    overflow.detections, overflow.injections, overflow.unfused_tracks = 0, 0, 0
    overflow.evicted_tracks, overflow.dropped_births = 0, 0
    clear_verdict(world)
    draw_picture(world)
    if world.parameters.keep_coverage:
        forget_coverage(world)
    place_agents(world)
    place_targets(world)


START = Stage(start_episode)
FORGET = Stage("reset")
EDIT = Stage(edit_reports)
LOCATE = Stage(locate_fovs)
TRACK_LOCALLY = Stage(track_locally)
TRACK_CENTRALLY = Stage(track_centrally)
GATHER_EVIDENCE = Stage(gather_evidence)
CLEAR_VERDICT = Stage(clear_verdict)
JUDGE = Stage("judge")
WEIGH = Stage(weigh_agents)
PUBLISH = Stage(publish)
SCORE = Stage(score_picture)
REWARD = Stage(compute_rewards)
REMOVE = Stage(remove_distrusted)
MOVE = Stage(move_targets)
SENSE = Stage(sense)
OBSERVE = Stage(observe)

# The order in which they run, whichever of them are asked for.
FRAME = (
    START, FORGET,                                                  # where an episode begins
    EDIT,                                                           # 1: actions edit the raw detections
    LOCATE, TRACK_LOCALLY, TRACK_CENTRALLY, GATHER_EVIDENCE,        # 2: the trackers take the reports
    CLEAR_VERDICT, JUDGE, WEIGH, PUBLISH,                           # 3: the defense judges, and the picture
    SCORE, REWARD, REMOVE,                                          # 4: the picture against the truth
    MOVE, SENSE, OBSERVE,                                           # 5: targets move, agents sense again
)  # fmt: skip


OWN_DEFENSE = -1  # the number of a user's own, which has no kernels


def stages(*wanted: Stage) -> int:
    """Stages as one number, to be joined with `|`."""
    return sum(stage.bit for stage in wanted)


BEGIN = stages(START, FORGET, SENSE, OBSERVE)
EDIT_AND_TRACK = stages(EDIT, TRACK_LOCALLY, TRACK_CENTRALLY, GATHER_EVIDENCE)
TRACK_AS_REPORTED = stages(LOCATE, TRACK_LOCALLY, TRACK_CENTRALLY, GATHER_EVIDENCE)  # poses and reports as given
JUDGE_BUILT_IN = stages(CLEAR_VERDICT, JUDGE, WEIGH)
JUDGE_NOTHING = stages(CLEAR_VERDICT)
CONCLUDE = stages(PUBLISH, REMOVE)
NEXT_FRAME = stages(SCORE, REWARD, MOVE, SENSE, OBSERVE)


def declare_defenses() -> None:
    """Give the built-in defenses' parameters and memory a place among the fields, each in a group of its name."""
    for name, defense in DEFENSES.items():
        if name in WORLD_GROUPS:
            raise ValueError(f"a defense cannot be called {name!r}, as fields of the world are")
        declare(name, f"{name}_", PARAMETERS, defense.parameters)
        declare(name, f"{name}_", ROW, defense.memory)
        declare(name, f"{name}_", SCRATCH, defense.scratch)


def engine() -> Entry:
    """The entry that runs stages in worlds: `(shared, thread, stages, patience)`, see `share_work`."""
    declare_defenses()
    return _engine(tuple(DEFENSES.values()))


@functools.cache
def _engine(defenses: tuple[type[BuiltIn], ...]) -> Entry:
    def kernel_of(stage: Stage) -> Any:
        if not isinstance(stage.run, str):
            return stage.run
        run = choose([getattr(defense, stage.run) for defense in defenses], "world")

        @kernel
        def run_for_defense(world):
            if world.parameters.defense != OWN_DEFENSE:
                run(world.parameters.defense, world)

        return run_for_defense

    run_stage, number_of_stages = choose([kernel_of(stage) for stage in FRAME], "world"), len(FRAME)

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
