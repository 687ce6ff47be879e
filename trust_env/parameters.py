"""A scenario and a defense as numbers: the layout of the worlds, and the buffer of parameters they share."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from trust_env.compiled.layout import PARAMETERS, Layout
from trust_env.defenses import DEFENSES, BuiltIn, Defense
from trust_env.defenses.base import OPTIONAL
from trust_env.frame import declare_defenses
from trust_env.scenario import Scenario
from trust_env.scenario.fov import SHAPES
from trust_env.spaces.action import ActionTable
from trust_env.spaces.observation import REACH, ObservationTable, Scales
from trust_env.theory import initial_score, score_thresholds
from trust_env.world import targets as target_sources
from trust_env.world.agents import PLACEMENTS, ROLES
from trust_env.world.coverage import CELLS
from trust_env.world.fields import WORLD_GROUPS
from trust_env.world.picture import ACTUATIONS
from trust_env.world.tracking.fusion import FUSIONS
from trust_env.world.tracking.score import CONFIRMATIONS, DELETIONS


def name_of(defense: BuiltIn) -> str:
    """The name of a built-in defense, which is that of its group of fields."""
    return list(DEFENSES)[list(DEFENSES.values()).index(type(defense))]


def needs_of(defense: BuiltIn | Defense) -> tuple[str, ...]:
    """What is gathered for a defense only because it asks for it; a user's own gets everything."""
    return defense.needs if isinstance(defense, BuiltIn) else OPTIONAL


def lengths_of(scenario: Scenario, defense: BuiltIn | Defense) -> dict[str, int]:
    """Lengths of all axes but O, the observation's."""
    numbers = [len(scenario.agent(k).fov.shape.numbers) for k in range(scenario.n_agents)]
    recording = scenario.recording()
    n = {
        "K": scenario.n_agents,
        "N": max(1, len(scenario.targets.positions or ()) or scenario.targets.slots),
        "D": scenario.sensor.max_detections,
        "J": scenario.tracker.max_tracks,
        "L": scenario.tracker.max_local_tracks,
        "A": ActionTable(scenario).size,
        "F": max(1, *numbers),
        "T": 1 if recording is None else len(recording.times),
        "B": scenario.retro_window if scenario.actuation == "retro" else 0,
        "Q": CELLS if "coverage" in needs_of(defense) else 0,
    }
    n["U"] = 0 if scenario.tracker.fusion == "sequential" else n["J"]
    n["R"] = max(n["D"], n["L"], n["J"])  # rows and columns of any assignment
    n["S"] = n["R"] + 1
    n["C"] = max(n["J"], n["N"], n["L"])
    n["P"] = max(n["D"] * n["C"], n["L"] * n["J"], n["J"] * n["N"])
    return n | (defense.lengths(scenario.n_agents) if isinstance(defense, BuiltIn) else {})


def scales_of(scenario: Scenario) -> Scales:
    """The square that holds the area, all fixed agents and their FOVs; the fastest speed to be expected."""
    reach = np.array([scenario.agent(k).fov.reach for k in range(scenario.n_agents)])
    x0, x1, y0, y1 = scenario.area
    points = [(x0, y0), (x1, y1)]
    for k in range(scenario.n_agents):
        position = scenario.agent(k).position
        if position is not None:
            points += [
                (position[0] - reach[k], position[1] - reach[k]),
                (position[0] + reach[k], position[1] + reach[k]),
            ]
    if any(scenario.agent(k).position is None for k in range(scenario.n_agents)):
        points += [(x0 - reach.max(), y0 - reach.max()), (x1 + reach.max(), y1 + reach.max())]
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    speed = scenario.targets.speed[1] + 3.0 * math.sqrt(scenario.tracker.initial_velocity_variance)
    return Scales((low + high) / 2, float(np.max(high - low)) / 2, speed, REACH * reach)


class Parameters:
    """Layout, observation and action tables and parameter buffer of a scenario under a defense."""

    def __init__(self, scenario: Scenario, defense: BuiltIn | Defense, horizon: int):
        declare_defenses()
        self.lengths, self.actions = lengths_of(scenario, defense), ActionTable(scenario)
        self.observation = ObservationTable(scenario, scales_of(scenario), self.lengths)
        self.lengths["O"] = self.observation.size
        own = (name_of(defense),) if isinstance(defense, BuiltIn) else ()
        self.layout = Layout(self.lengths, (*WORLD_GROUPS, *own))
        self.buffer = np.zeros(self.layout.sizes[PARAMETERS], dtype=np.uint8)
        self.set(horizon=horizon, **self.actions.parameters())
        self._set_world(scenario)
        self._set_targets(scenario)
        for k in range(scenario.n_agents):
            self._set_agent(scenario, k)
        self._set_tracker(scenario)
        self._set_defense(scenario, defense)

    def __getitem__(self, name: str) -> np.ndarray:
        """The live view of a field."""
        return self.layout.view(self.buffer, name)

    def set(self, **values: Any) -> None:
        """Write fields by name."""
        for name, value in values.items():
            self[name][...] = value

    def _set_world(self, s: Scenario) -> None:
        scales, evidence, metrics, reward = self.observation.scales, s.evidence, s.metrics, s.reward
        self.set(scale_centre=scales.centre, scale_half=scales.half, scale_speed=scales.speed)
        self.set(scale_offset=self.observation.offsets(), actuation=ACTUATIONS[s.actuation])
        self.set(placement=PLACEMENTS.get(s.team.placement, 0), spread=s.team.spread)
        self.set(near_distance=evidence.near_distance or 0.0, hold_distance=evidence.hold_distance)
        self.set(match_distance=metrics.match_distance, cutoff=metrics.cutoff, order=metrics.order)
        self.set(accuse_below=metrics.accuse_below, accuse_frames=metrics.accuse_frames)
        self.set(reward_false_track=reward.false_track, reward_missing_target=reward.missing_target)
        self.set(reward_lost_trust=reward.lost_trust)

    def _set_targets(self, s: Scenario) -> None:
        targets, recording = s.targets, s.recording()
        self.set(target_area=s.area, target_speed=targets.speed, target_process_noise=targets.process_noise)
        alive, born = (targets.initial, targets.birth_rate) if targets.slots else (0.0, 0.0)
        self.set(target_initial_probability=alive, target_birth_rate=born, target_death_rate=targets.death_rate)
        self.set(target_source=target_sources.DRAWN, target_record=np.nan)
        if recording is not None:
            record = _with_velocity(recording.positions, s.dt)
            self.set(target_source=target_sources.RECORDED, target_record=record)
        elif targets.positions:
            start = np.zeros((len(targets.positions), 4))
            start[:, :2] = targets.positions
            start[:, 2:] = np.nan if targets.velocities is None else targets.velocities  # NaN: drawn
            self.set(target_source=target_sources.FIXED, target_start_state=start)

    def _set_agent(self, s: Scenario, k: int) -> None:
        agent = s.agent(k)
        fov, shape, belief = agent.fov, agent.fov.shape, agent.belief
        values = {
            "role": ROLES[agent.role],
            "platform": s.platforms[k],
            "start_pose": (*(agent.position or (0.0, 0.0)), agent.heading),
            "pose_drawn": agent.position is None,
            "fov_shape": list(SHAPES).index(fov.type),
            "fov_is_round": shape.is_round,
            "fov_radius": shape.reach,
            "fov_start_heading": shape.opening[0],
            "fov_half_width": shape.opening[1],
            "clutter_mean": agent.sensor.clutter_density * fov.area,
            "p_detect": agent.sensor.p_detect,
            "resolution": agent.sensor.resolution or 0.0,
            "noise_cov": agent.sensor.covariance,
            "noise_chol": np.linalg.cholesky(np.array(agent.sensor.covariance)),
            "injection_budget": min(agent.budget.injections, s.injection.slots),
            "suppression_budget": agent.budget.suppressions,
            "initial_score": initial_score(p_detect=belief.p_detect, beta_fp=belief.beta_fp, beta_nt=belief.beta_nt),
            "hit_constant": math.log(belief.p_detect / (2 * math.pi * belief.beta_fp)),
            "miss_gain": math.log1p(-belief.p_detect),
            "believed_p_detect": belief.p_detect,
            "believed_beta_fp": belief.beta_fp,
            "believed_beta_nt": belief.beta_nt,
            "prior_compromised": math.nan if belief.compromised is None else belief.compromised,
        }
        self["fov_numbers"][k, : len(shape.numbers)] = shape.numbers
        for name, value in values.items():
            self[name][k] = value

    def _set_tracker(self, s: Scenario) -> None:
        t = s.tracker
        delete, confirm = score_thresholds(alpha=t.alpha, beta=t.beta)
        self.set(process_noise=t.process_noise, velocity_variance=t.initial_velocity_variance)
        self.set(gate=-2.0 * math.log1p(-t.gate), max_unseen=t.max_unseen)
        self.set(fusion=FUSIONS[t.fusion], fusion_tolerance=t.fusion_tolerance)
        self.set(confirmation=CONFIRMATIONS[t.confirmation], confirm_threshold=confirm)
        self.set(confirm_m=t.confirm_m, confirm_n=t.confirm_n, confirm_hits=t.confirm_hits)
        self.set(deletion=DELETIONS[t.deletion], delete_threshold=delete)
        self.set(confirmed_drop=t.confirmed_drop, tentative_drop=t.tentative_drop)

    def _set_defense(self, s: Scenario, defense: BuiltIn | Defense) -> None:
        if isinstance(defense, BuiltIn):
            prefix = name_of(defense)
            self.set(**{f"{prefix}_{name}": value for name, value in defense.values(s.n_agents).items()})
        self.set(**{f"keep_{what}": what in needs_of(defense) for what in OPTIONAL})


def _with_velocity(positions: np.ndarray, dt: float) -> np.ndarray:
    """Recorded positions `[T, N, 2]` with forward differences as velocities: `[T, N, 4]`, NaN where
    absent.
    """
    velocity = np.zeros_like(positions)
    velocity[:-1] = (positions[1:] - positions[:-1]) / dt
    # The last point before a gap keeps the velocity that it came with.
    ends = np.isnan(velocity[..., 0]) & ~np.isnan(positions[..., 0])
    for t, n in zip(*np.nonzero(ends), strict=True):
        before = velocity[t - 1, n] if t else np.zeros(2)
        velocity[t, n] = np.where(np.isnan(before), 0.0, before)
    return np.concatenate([positions, velocity], axis=-1)
