"""A scenario and a defense as numbers: the layout of the worlds, and the buffer of parameters they share."""

from __future__ import annotations

import math

import numpy as np

from trust_env.defenses import BuiltIn, Defense
from trust_env.scenario import Scenario
from trust_env.spaces.observation import KNOWLEDGE, REACH, ObservationTable, Scales
from trust_env.theory import initial_score, score_thresholds
from trust_env.world import sensing
from trust_env.world import targets as motion
from trust_env.world.fields import Layout
from trust_env.world.fov import CODES as FOV_CODES
from trust_env.world.scoring import ACTUATIONS
from trust_env.world.tracking.score import CONFIRMATIONS, DELETIONS

ROLES = {"adversary": 1, "benign": -1}
PLACEMENTS = {"random": sensing.PLACED_RANDOM, "overlapping": sensing.PLACED_OVERLAPPING}
OWN_DEFENSE = -1  # `defense` of a user's own


def action_size(scenario: Scenario) -> int:
    """A = 3M + D."""
    return 3 * scenario.injection.slots + scenario.sensor.max_detections


def dims_of(scenario: Scenario, defense: BuiltIn | Defense) -> dict[str, int]:
    """Lengths of all axes but O, the observation's."""
    vertices = [len(scenario.agent(k).fov.vertices or ()) for k in range(scenario.n_agents)]
    recording = scenario.recording()
    dims = {
        "K": scenario.n_agents,
        "N": max(1, len(scenario.targets.positions or ()) or scenario.targets.slots),
        "D": scenario.sensor.max_detections,
        "J": scenario.tracker.max_tracks,
        "L": scenario.tracker.max_local_tracks,
        "M": scenario.injection.slots,
        "A": action_size(scenario),
        "V": max(3, *vertices),
        "T": 1 if recording is None else len(recording.times),
        "H": defense.history if isinstance(defense, BuiltIn) else 1,
    }
    dims["R"] = max(dims["D"], dims["L"], dims["J"])  # rows and columns of any assignment
    dims["C"] = max(dims["J"], dims["N"], dims["L"])
    dims["P"] = max(dims["D"] * dims["C"], dims["L"] * dims["J"], dims["J"] * dims["N"])
    return dims


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


class Pack:
    """Layout, observation table and parameter buffer of a scenario under a defense."""

    def __init__(self, scenario: Scenario, defense: BuiltIn | Defense, horizon: int):
        self.dims = dims_of(scenario, defense)
        self.observation = ObservationTable(scenario, scales_of(scenario), self.dims)
        self.dims["O"] = self.observation.size
        self.layout = Layout(self.dims)
        self.params = np.zeros(self.layout.param_bytes, dtype=np.uint8)
        self._fill_world(scenario, horizon)
        self._fill_agents(scenario)
        self._fill_tracker(scenario)
        self._fill_defense(scenario, defense)

    def set(self, **values) -> None:
        """Write parameter fields by name."""
        for name, value in values.items():
            self.layout.view(self.params, name)[...] = value

    def _fill_world(self, s: Scenario, horizon: int) -> None:
        scales, targets = self.observation.scales, s.targets
        self.set(
            horizon=horizon,
            knowledge=KNOWLEDGE[s.knowledge],
            shared=s.coordination == "shared",
            actuation=ACTUATIONS[s.actuation],
        )
        self.set(
            extent_centre=scales.centre,
            extent_half=scales.half,
            speed_scale=scales.speed,
            observation_offset=self.observation.offsets(),
        )
        self.set(area=s.area, speed=targets.speed, target_noise=targets.process_noise)
        alive = targets.initial if targets.slots else 0.0
        born = targets.birth_rate if targets.slots else 0.0
        self.set(initial_probability=alive, birth_rate=born, death_rate=targets.death_rate)
        self.set(placement=PLACEMENTS.get(s.team.placement, 0), spread=s.team.spread)
        self.set(target_source=motion.DRAWN, record=np.nan)
        recording = s.recording()
        if recording is not None:
            self.set(target_source=motion.RECORDED, record=_with_velocity(recording.positions, s.dt))
        elif targets.positions is not None and targets.positions:
            start = np.zeros((len(targets.positions), 4))
            start[:, :2] = targets.positions
            start[:, 2:] = np.nan if targets.velocities is None else targets.velocities  # NaN: drawn
            self.set(target_source=motion.FIXED, start_state=start)
        self.set(match_distance=s.metrics.match_distance, cutoff=s.metrics.cutoff, order=s.metrics.order)
        self.set(near_distance=s.evidence.near_distance or 0.0, hold_distance=s.evidence.hold_distance)
        r = s.reward
        self.set(
            reward_false_track=r.false_track,
            reward_missing_target=r.missing_target,
            reward_lost_trust=r.lost_trust,
        )

    def _fill_agents(self, s: Scenario) -> None:
        view = {
            name: self.layout.view(self.params, name)
            for name in self.layout.kinds
            if self.layout.kinds[name][0] == 1
        }
        for k in range(s.n_agents):
            agent = s.agent(k)
            view["role"][k] = ROLES[agent.role]
            view["start_pose"][k] = (*(agent.position or (0.0, 0.0)), agent.heading)
            view["pose_drawn"][k] = agent.position is None
            fov = agent.fov
            view["fov_type"][k], view["fov_radius"][k] = FOV_CODES[fov.type], fov.reach
            view["fov_heading"][k] = fov.heading if fov.type == "sector" else 0.0
            view["fov_half_width"][k] = fov.width / 2 if fov.type == "sector" else math.pi
            if fov.type == "polygon":
                corners = _counterclockwise(np.array(fov.vertices))
                view["fov_sides"][k], view["fov_vertices"][k, : len(corners)] = len(corners), corners
            view["clutter_mean"][k] = agent.sensor.clutter_density * fov.area
            view["p_detect"][k] = agent.sensor.p_detect
            view["noise_cov"][k] = agent.sensor.covariance
            view["noise_chol"][k] = np.linalg.cholesky(view["noise_cov"][k])
            view["injection_budget"][k] = min(agent.budget.injections, s.injection.slots)
            view["suppression_budget"][k] = agent.budget.suppressions
            p, fp = agent.belief.p_detect, agent.belief.beta_fp
            view["initial_score"][k] = initial_score(p_detect=p, beta_fp=fp, beta_nt=agent.belief.beta_nt)
            view["hit_constant"][k], view["miss_gain"][k] = math.log(p / (2 * math.pi * fp)), math.log1p(-p)

    def _fill_tracker(self, s: Scenario) -> None:
        t = s.tracker
        delete, confirm = score_thresholds(alpha=t.alpha, beta=t.beta)
        self.set(
            process_noise=t.process_noise,
            velocity_variance=t.initial_velocity_variance,
            gate=-2.0 * math.log1p(-t.gate),
        )
        self.set(
            confirm_threshold=confirm,
            delete_threshold=delete,
            confirmed_drop=t.confirmed_drop,
            tentative_drop=t.tentative_drop,
        )
        self.set(
            confirmation=CONFIRMATIONS[t.confirmation],
            deletion=DELETIONS[t.deletion],
            max_unseen=t.max_unseen,
        )
        self.set(confirm_m=t.confirm_m, confirm_n=t.confirm_n, confirm_hits=t.confirm_hits)

    def _fill_defense(self, s: Scenario, defense: BuiltIn | Defense) -> None:
        if isinstance(defense, BuiltIn):
            values, priors = defense.pack(s.n_agents)
            self.set(defense=defense.code, defense_params=values, agent_prior=priors)
        else:
            self.set(defense=OWN_DEFENSE, full_evidence=1)


def _counterclockwise(corners: np.ndarray) -> np.ndarray:
    x, y = corners.T
    doubled_area = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    return corners if doubled_area > 0 else corners[::-1]


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
