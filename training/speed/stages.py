"""Where a frame's time goes: every stage of the engine by itself."""

from __future__ import annotations

import statistics
import time

from trust_env import frame
from trust_env.training.speed.subjects import attack_actions
from trust_env.vector import VectorEnv

FRAMES = 60
WARM_UP = 20  # frames after which there are tracks

_OF_A_STEP = frame.EDIT_AND_TRACK | frame.JUDGE_BUILT_IN | frame.CONCLUDE | frame.NEXT_FRAME


def stage_times(venv: VectorEnv) -> dict[str, float]:
    """By name, in the order in which they run: the median time (s) that a world takes of each stage of a step.

    venv: with a built-in defense, and episodes longer than `WARM_UP` + `FRAMES`.
    """
    stages = [stage for stage in frame.FRAME if stage.bit & _OF_A_STEP]
    found: dict[str, list[float]] = {stage.run.__name__: [] for stage in stages}
    actions = attack_actions(venv.scenario, venv.arrays.action.shape)
    venv.reset(seed=0)
    for _ in range(WARM_UP):
        venv.step(actions)
    with venv.worlds.use:
        venv.arrays.action[...] = actions
        for _ in range(FRAMES):
            for stage in stages:
                started = time.perf_counter()
                venv.worlds.run(stage.bit)
                found[stage.run.__name__].append(time.perf_counter() - started)
    return {name: statistics.median(times) / venv.num_worlds for name, times in found.items()}
