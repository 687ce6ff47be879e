"""What actions do to reports: budgets, clipping, overflow, and what goes first when a report is full."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from kernels import fov_of

import trust_env
from trust_env.spaces.action import ActionTable
from trust_env.vector import VectorEnv

INJECTED = -2  # `report_origin` of injection slot m is INJECTED - m


def env_of(n_worlds: int = 4, **scenario: Any) -> VectorEnv:
    return trust_env.vector_env({"base": "patrol", **scenario}, "score", num_worlds=n_worlds, threads=1)


class Raw:
    """What an agent has seen, and its FOV, before its action edits it."""

    def __init__(self, env: VectorEnv, w: int, k: int):
        arrays = env.arrays
        self.agent, self.slots = env.scenario.agent(k), env.scenario.injection.slots
        self.capacity = env.scenario.sensor.max_detections
        n = arrays.raw_count[w, k]
        self.points, self.origins = (
            arrays.raw_detections[w, k, :n].copy(),
            arrays.raw_origin[w, k, :n].copy(),
        )
        self.pose, self.box = arrays.pose[w, k].copy(), arrays.fov_box[w, k].copy()
        self.holds = fov_of(env.scenario, k, self.pose)

    def edited(self, action: np.ndarray) -> tuple[list, list, list]:
        """Honest points with origins, and the slots and wanted positions of the injections that fit."""
        wanted = action[: 3 * self.slots].reshape(-1, 3)
        fired = [m for m in range(min(self.slots, self.agent.budget.injections)) if wanted[m, 0] > 0]
        fired = fired[: self.capacity]
        low, high = self.box[0::2], self.box[1::2]
        places = [low + (np.clip(wanted[m, 1:], -1, 1) + 1) / 2 * (high - low) for m in fired]
        withheld = [
            d for d in range(min(len(self.points), self.agent.budget.suppressions)) if action[3 * self.slots + d] > 0
        ]
        kept = [d for d in range(len(self.points)) if d not in withheld][: self.capacity - len(fired)]
        return [(self.points[d], self.origins[d]) for d in kept], fired, places


def check_reports(env: VectorEnv, raws: list[list[Raw]], actions: np.ndarray) -> int:
    """Compare all reports with what the actions ask for; returns how many injections were made."""
    arrays, injected = env.arrays, 0
    for w, row in enumerate(raws):
        for k, raw in enumerate(row):
            honest, fired, places = raw.edited(actions[w, k])
            count = arrays.report_count[w, k]
            assert count == len(honest) + len(fired)
            report, origin = arrays.report_detections[w, k, :count], arrays.report_origin[w, k, :count]
            for d, (point, where_from) in enumerate(honest):
                assert (report[d] == point).all() and origin[d] == where_from
            for place, m, point, where_from in zip(places, fired, report[len(honest) :], origin[len(honest) :]):
                assert where_from == INJECTED - m
                assert raw.holds(point)
                if raw.holds(place):
                    assert point == pytest.approx(place, abs=1e-9)
                injected += 1
    return injected


def all_raws(env: VectorEnv) -> list[list[Raw]]:
    n_agents = env.scenario.n_agents
    return [[Raw(env, w, k) for k in range(n_agents)] for w in range(env.num_worlds)]


SCENARIOS: dict[str, dict[str, Any]] = {
    "default": {},
    "all may do all": {"injection": {"slots": 4, "benign": None}},
    "small budgets": {
        "injection": {"slots": 5, "adversary": 2, "benign": 1},
        "suppression": {"adversary": 3, "benign": 1},
    },
    "no budget": {"injection": {"slots": 2, "adversary": 0}, "suppression": {"adversary": 0, "benign": 0}},
    "no injections at all": {"injection": {"slots": 0}},
    "full reports": {"injection": {"slots": 4, "benign": None}, "sensor": {"max_detections": 5}},
    "as many slots as detections": {"injection": {"slots": 3}, "sensor": {"max_detections": 3}},
    "budgets of their own": {
        "agents": [
            {"role": "adversary", "position": [0, 0], "budget": {"injections": 1, "suppressions": 2}},
            {
                "role": "benign",
                "position": [50, 0],
                "heading": 2.0,
                "budget": {"injections": 3},
                "fov": {"type": "sector", "radius": 300, "width": 1.0},
            },
            {
                "role": "adversary",
                "position": [-50, 0],
                "fov": {"type": "polygon", "vertices": [[0, 0], [300, 0], [0, 300]]},
            },
        ]
    },
}


@pytest.mark.core
@pytest.mark.parametrize("name", SCENARIOS)
def test_reports_are_what_the_actions_ask_for(name):
    env = env_of(**SCENARIOS[name])
    rng = np.random.default_rng(1)
    env.reset(seed=1)
    injected = 0
    for frame in range(25):
        raws = all_raws(env)
        actions = rng.uniform(-1.0, 1.0, env.arrays.action.shape) * rng.choice([1.0, 3.0, 1e6])
        if frame % 5 == 0:
            actions = np.abs(actions)  # everybody does everything
        env.step(actions)
        injected += check_reports(env, raws, actions)
    assert (injected > 0) == (name not in ("no budget", "no injections at all"))


@pytest.mark.core
@pytest.mark.nojit
def test_the_zero_action_is_the_honest_one():
    env = env_of(1, base="trio")
    env.reset(seed=2)
    for _ in range(8):
        raws = all_raws(env)
        env.step(np.zeros(env.arrays.action.shape))
        assert check_reports(env, raws, np.zeros(env.arrays.action.shape)) == 0
        for k, raw in enumerate(raws[0]):
            count = env.arrays.report_count[0, k]
            assert (env.arrays.report_detections[0, k, :count] == raw.points).all()


@pytest.mark.core
def test_raw_detections_stand_by_distance_and_the_nearest_stay():
    wide, narrow = (
        {"sensor": {"max_detections": d, "clutter_density": 1e-5}, "tracker": {"beta_fp": 1e-5}} for d in (60, 5)
    )
    envs = [env_of(injection={"slots": 2}, **more) for more in (wide, narrow)]
    dropped = 0
    for env in envs:
        env.reset(seed=3)
    for _ in range(10):
        full, few = envs[0].arrays, envs[1].arrays
        for w, k in np.ndindex(full.raw_count.shape):
            n, m = full.raw_count[w, k], few.raw_count[w, k]
            distance = np.hypot(*(full.raw_detections[w, k, :n] - full.pose[w, k, :2]).T)
            assert (np.diff(distance) >= 0.0).all()
            assert m == min(n, 5)
            assert (few.raw_detections[w, k, :m] == full.raw_detections[w, k, :m]).all()
            assert (few.raw_origin[w, k, :m] == full.raw_origin[w, k, :m]).all()
            dropped += n - m
        assert (full.overflow_detections == 0).all() and few.overflow_detections.sum() == dropped
        for env in envs:
            env.step(np.zeros(env.arrays.action.shape))
    assert dropped > 50


@pytest.mark.core
def test_a_full_report_gives_up_its_farthest_honest_detections_and_counts_them():
    env = env_of(1, injection={"slots": 4, "benign": None}, sensor={"max_detections": 4})
    table = ActionTable(env.scenario)
    env.reset(seed=4)
    lost = 0
    for _ in range(20):
        before, raw_counts = env.arrays.overflow_detections[0], env.arrays.raw_count[0].copy()
        actions = np.zeros(env.arrays.action.shape)
        actions[..., table["injections"]][..., 0::3][..., :3] = 1.0  # three of four slots
        env.step(actions)
        lost_now = int(np.maximum(raw_counts - 1, 0).sum())
        assert env.arrays.report_count[0].tolist() == (np.minimum(raw_counts, 1) + 3).tolist()
        sensed = env.arrays.overflow_detections[0] - before - lost_now  # what sensing the next frame dropped
        assert sensed >= 0 and env.arrays.overflow_injections[0] == 0
        lost += lost_now
    assert lost > 20


@pytest.mark.core
def test_suppressed_detections_make_room():
    env = env_of(1, injection={"slots": 4, "benign": None}, sensor={"max_detections": 4})
    env.reset(seed=5)
    for _ in range(10):
        before, n = env.arrays.overflow_detections[0], env.arrays.raw_count[0].copy()
        env.step(np.ones(env.arrays.action.shape))
        assert (env.arrays.report_count[0] == 4).all()
        assert (env.arrays.report_origin[0] == [[-2, -3, -4, -5]] * len(n)).all()
        assert env.arrays.overflow_detections[0] - before <= env.arrays.raw_count[0].sum() + 4 * len(n)


def test_metres_to_actions_and_back():
    env = env_of(3, injection={"slots": 4, "benign": None})
    env.reset(seed=6)
    rng = np.random.default_rng(6)
    for _ in range(5):
        pose, box = env.arrays.pose.copy(), env.arrays.fov_box.copy()
        places = pose[..., None, :2] + rng.uniform(-200, 200, (*pose.shape[:2], 4, 2))  # inside the circle of 350 m
        fire = rng.random(places.shape[:-1]) < 0.6
        suppress = rng.random((*pose.shape[:2], env.scenario.sensor.max_detections)) < 0.3
        kept = ~suppress & (np.arange(suppress.shape[-1]) < env.arrays.raw_count[..., None])
        honest = [[env.arrays.raw_detections[w, k][kept[w, k]] for k in range(pose.shape[1])] for w in range(3)]
        actions = ActionTable(env.scenario).encode(box, places, fire, suppress)
        assert actions.dtype == np.float32 and np.abs(actions).max() <= 1.0
        env.step(actions)
        for w, k in np.ndindex(fire.shape[:2]):
            count = env.arrays.report_count[w, k]
            expected = np.concatenate([honest[w][k], places[w, k][fire[w, k]]])
            assert env.arrays.report_detections[w, k, :count] == pytest.approx(expected, abs=1e-3)  # float32 actions


def test_places_outside_are_moved_to_the_edge():
    env = env_of(1, injection={"slots": 1, "benign": None})
    env.reset(seed=7)
    pose = env.arrays.pose[0].copy()
    far = pose[:, None, :2] + np.array([1e4, 1e4])
    env.step(ActionTable(env.scenario).encode(env.arrays.fov_box, far[None]))
    for k in range(len(pose)):
        point = env.arrays.report_detections[0, k, env.arrays.report_count[0, k] - 1]
        edge = pose[k, :2] + 350.0 * np.sqrt(0.5) * (1 - 1e-6)
        assert point == pytest.approx(edge, abs=1e-6)
