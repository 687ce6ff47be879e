"""Theorem 1 (paper, Sec. III): how many frames a false positive needs, by theory and in the simulation."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from trust_env import theory
from trust_env.agents import Player
from trust_env.scenario import Scenario, load_scenario
from trust_env.vector import VectorEnv
from trust_env.world.tracking.score import CONFIRMED

N_ADVERSARIES, N_BENIGN, ORDERS = (1, 2, 3), tuple(range(7)), ("first", "last")
OPTIMAL_ATTACK = "optimal_false_positive"
OTHER_ATTACKS = (
    "random",
    "false_positive",
    "false_positive(motion=random_walk)",
    "optimal_false_positive(hit_rate=0.9)",
)
OTHER_ATTACK_FRAMES = 24  # beyond the last finite frame of the table


@dataclass(frozen=True)
class TheoremRow:
    """Frames until an FP is confirmed, counted from 1, infinity: never.

    order           whether the adversaries come "first" or "last" among the agents
    theorem         T_min of Theorem 1
    bound           ⌈T_seq⌉ corrected for several adversaries
    recursion       of the score with the filter's own S, `score_optimal_frames`
    simulated       the optimal attack in the environment
    earliest_other  the earliest of other policies (earliest_policy) over all seeds
    excess          nats, the most that a frame of these attacks added to a score, beyond Prop. 2: at most 0
    """

    n_adversaries: int
    n_benign: int
    order: str
    theorem: float
    bound: float
    recursion: float
    simulated: float
    earliest_other: float
    earliest_policy: str
    excess: float

    @property
    def exact(self) -> bool:
        """The simulation confirms in the frame that the recursion gives."""
        return self.simulated == self.recursion

    @property
    def bounded(self) -> bool:
        """Nothing confirms before the bound, nor adds more to a score than Prop. 2 allows."""
        return min(self.simulated, self.earliest_other) >= self.bound and self.excess <= 1e-9

    @property
    def ok(self) -> bool:
        return self.exact and self.bounded


def theorem_rows(seeds: int, advance: Callable[[int], Any] = lambda _: None) -> list[TheoremRow]:
    """The whole table, `seeds` worlds for every policy; `advance(1)` is called after every row."""
    rows = []
    for n_adversaries, n_benign, order in theorem_cells():
        rows.append(theorem_row(n_adversaries, n_benign, order, seeds))
        advance(1)
    return rows


def theorem_cells() -> Iterator[tuple[int, int, str]]:
    return ((a, b, order) for a in N_ADVERSARIES for b in N_BENIGN for order in ORDERS)


def theorem_row(n_adversaries: int, n_benign: int, order: str, seeds: int) -> TheoremRow:
    """One row: theory, then simulation."""
    team = {"n_adversaries": n_adversaries, "n_benign": n_benign, "order": f"adversaries_{order}"}
    scenario = load_scenario("theorem", **team)
    belief, filtering = theory_arguments(scenario)
    change = theory.max_score_change(n_adversaries, n_benign, p_detect=belief["p_detect"], beta_fp=belief["beta_fp"])
    simulated, gain = first_confirmed(scenario, OPTIMAL_ATTACK, 2, scenario.horizon)
    frames = OTHER_ATTACK_FRAMES
    others = {policy: first_confirmed(scenario, policy, seeds, frames) for policy in OTHER_ATTACKS}
    earliest = min(others, key=lambda policy: others[policy][0])
    return TheoremRow(
        n_adversaries,
        n_benign,
        order,
        theorem=theory.frames_to_confirm(n_adversaries, n_benign, **belief),
        bound=ceil_frames(theory.sequential_frames_to_confirm(n_adversaries, n_benign, **belief)),
        recursion=theory.score_optimal_frames(scenario.roles, **belief, **filtering),
        simulated=simulated,
        earliest_other=others[earliest][0],
        earliest_policy=earliest,
        excess=max(gain, *(gain for _, gain in others.values())) - change,
    )


def theory_arguments(scenario: Scenario) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the theory needs to know of a scenario: beliefs and thresholds, and the filter."""
    tracker, belief = scenario.tracker, scenario.agent(0).belief
    densities = {"p_detect": belief.p_detect, "beta_fp": belief.beta_fp, "beta_nt": belief.beta_nt}
    filtering = {
        "noise_cov": scenario.sensor.noise_cov,
        "initial_velocity_variance": tracker.initial_velocity_variance,
        "process_noise": tracker.process_noise,
        "dt": scenario.dt,
        "tentative_drop": tracker.tentative_drop,
    }
    return densities | {"alpha": tracker.alpha, "beta": tracker.beta}, filtering


def first_confirmed(scenario: Scenario, policy: str, worlds: int, frames: int) -> tuple[float, float]:
    """The earliest frame that confirms a track in any world; the most that a frame added to a score, nats."""
    venv = VectorEnv(scenario, "score", worlds, max_cycles=frames, threads=1, autoreset=False)
    player, first, gain = Player(venv, {"adversary": policy}), math.inf, -math.inf
    observations, _ = venv.reset(seed=0)
    a = venv.arrays
    for frame in range(1, frames + 1):
        before, score = a.track_id.copy(), a.track_score.copy()
        observations, *_ = venv.step(player.actions(observations))
        stayed = (a.track_id == before) & (before >= 0)
        gain = max(gain, float(np.max(a.track_score - score, where=stayed, initial=-math.inf)))
        if first == math.inf and (a.track_status == CONFIRMED).any():
            first = float(frame)
    venv.close()
    return first, gain


def ceil_frames(frames: float) -> float:
    """The first whole frame that is not before `frames`; infinity stays."""
    return float(math.ceil(frames)) if math.isfinite(frames) else math.inf
