"""The PettingZoo face: observations hold what the world holds."""

from __future__ import annotations

import numpy as np
import pytest
from parallel_envs import random_actions

import trust_env


def test_observations_hold_role_time_pose_detections_picture_and_trust():
    scenario = {"base": "trio", "knowledge": "white_box", "coordination": "shared"}
    env = trust_env.parallel_env(scenario, "trust")
    rng = np.random.default_rng(2)
    observations, _ = env.reset(seed=2)
    for frame in range(30):
        a = env.arrays
        for k, agent in enumerate(env.possible_agents):
            read = env.observation_table.read(observations[agent], k)
            assert read["role"] == (1 if agent.startswith("adversary") else -1)
            assert read["time"] == pytest.approx(frame / 100)
            pose = a.pose[0, k]
            assert read["pose"] == pytest.approx([*pose[:2], np.cos(pose[2]), np.sin(pose[2])], abs=1e-3)
            n = a.raw_count[0, k]
            assert read["detections_mask"].sum() == n
            assert read["detections"][:n] == pytest.approx(a.raw_detections[0, k, :n], abs=1e-3)
            m = a.report_count[0, k]
            assert read["report_mask"].sum() == m
            assert read["report"][:m] == pytest.approx(a.report_detections[0, k, :m], abs=1e-3)
            shown = np.flatnonzero(a.published[0])
            assert read["picture_mask"].sum() == len(shown)
            assert read["picture"][: len(shown), :2] == pytest.approx(a.track_mean[0, shown, :2], abs=1e-2)
            exists = a.track_status[0] > 0
            assert read["tracks_status"] == pytest.approx(a.track_status[0] / 2)
            scores = a.track_score[0, exists].clip(-50, 50)
            assert read["tracks_score"][exists] == pytest.approx(scores, abs=1e-3)
            known = exists & ~np.isnan(a.track_trust[0])
            assert read["tracks_trust"][known, 0] == pytest.approx(a.track_trust[0, known], abs=1e-6)
            assert (read["tracks_trust"][exists & ~known] == -1).all()
            trust = np.nan_to_num(a.agent_trust[0], nan=-1.0)
            assert read["agents_trust"][:, 0] == pytest.approx(trust, abs=1e-6)
        observations, *_ = env.step(random_actions(env, rng))


def test_adversaries_observe_each_other_and_benign_agents_nobody():
    team = {"n_adversaries": 3, "n_benign": 1}
    scenario = {"base": "trio", "team": team, "coordination": "shared", "knowledge": "poses"}
    env = trust_env.parallel_env(scenario)
    rng = np.random.default_rng(3)
    observations, _ = env.reset(seed=3)
    for _ in range(15):
        a = env.arrays
        for k, agent in enumerate(env.possible_agents):
            read = env.observation_table.read(observations[agent], k)
            for other in range(4):
                allies = k != other and max(k, other) < 3
                for name, count, points in (
                    ("shared_detections", a.raw_count, a.raw_detections),
                    ("shared_reports", a.report_count, a.report_detections),
                ):
                    n = count[0, other] if allies else 0
                    assert read[f"{name}_mask"][other].sum() == n
                    assert read[name][other, :n] == pytest.approx(points[0, other, :n], abs=2e-3)
                x, y, heading = a.pose[0, other]
                expected = [x, y, np.cos(heading), np.sin(heading)]
                assert read["poses"][other] == pytest.approx(expected, abs=1e-3)
                assert read["fovs"][other, 0] == pytest.approx(250.0, rel=1e-5)
        observations, *_ = env.step(random_actions(env, rng))


def test_one_field_is_read_by_its_name():
    env = trust_env.parallel_env("trio", "trust")
    observations, _ = env.reset(seed=4)
    n = env.arrays.raw_count[0, 1]
    agent = env.possible_agents[1]
    points = env.observation_table.read(observations[agent], "detections")
    assert points.shape == (env.scenario.sensor.max_detections, 2) and points[:n] == pytest.approx(
        env.arrays.raw_detections[0, 1, :n], abs=1e-3
    )
    assert (points == env.observation_table.read(observations[agent], 1)["detections"]).all()
    with pytest.raises(KeyError, match="picture"):
        env.observation_table.read(observations[agent], "picture")  # of a higher knowledge level


def test_where_fovs_differ_the_agents_are_all_or_have_to_be_named():
    agents = [{"role": "adversary"}, {"role": "benign", "fov": {"radius": 100.0}}]
    venv = trust_env.vector_env({"base": "trio", "agents": agents}, "score", num_worlds=2)
    observations, _ = venv.reset(seed=4)
    whole = venv.observation_table.read(observations, "detections")
    assert (whole == venv.observation_table.read(observations, np.arange(2), "detections")).all()
    alone = venv.observation_table.read(observations[0, 1], 1, "detections")
    assert (alone == whole[0, 1]).all()
    with pytest.raises(ValueError, match="expected agents, their indices"):
        venv.observation_table.read(observations[0, 1], "detections")
