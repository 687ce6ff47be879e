"""The PettingZoo face: what every frame returns, and what an environment tells of itself."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from parallel_envs import random_actions
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, seed_test

import trust_env

KNOWLEDGE = ("own", "poses", "picture", "white_box")
INFO_KEYS = ["false_tracks", "injected_tracks", "missing_targets", "visible_targets", "published_tracks"]


@pytest.mark.core
@pytest.mark.parametrize("coordination", ["none", "shared"])
@pytest.mark.parametrize("knowledge", KNOWLEDGE)
def test_every_frame_returns_the_promised_types_inside_their_spaces(knowledge, coordination):
    scenario = {"base": "trio", "knowledge": knowledge, "coordination": coordination, "horizon": 40}
    env = trust_env.parallel_env({**scenario, "team": {"n_adversaries": 2, "n_benign": 2}}, "trust")
    rng = np.random.default_rng(0)
    observations, infos = env.reset(seed=0)
    for frame in range(40):
        assert list(observations) == list(infos) == env.possible_agents
        for agent, observation in observations.items():
            space = env.observation_space(agent)
            assert observation.dtype == np.float32 and observation.shape == space.shape
            assert space.contains(observation)
            assert list(infos[agent]) == INFO_KEYS
            assert all(type(value) is float and np.isfinite(value) for value in infos[agent].values())
        assert env.state().dtype == np.float32 and env.state_space.contains(env.state())
        assert env.agents == env.possible_agents
        agents = env.agents[:]
        scale = float(rng.choice([1.0, 5.0]))
        observations, rewards, terminations, truncations, infos = env.step(random_actions(env, rng, scale))
        assert list(rewards) == list(terminations) == list(truncations) == agents
        assert all(type(reward) is float and np.isfinite(reward) for reward in rewards.values())
        assert all(value is False for value in terminations.values())
        assert all(value is (frame == 39) for value in truncations.values())
    assert env.agents == []


def test_agents_metadata_and_spaces_are_those_documented():
    env = trust_env.parallel_env("case1")
    assert env.possible_agents == ["adversary_0", "benign_0", "adversary_1"]
    assert env.metadata["name"] == "trust_env_v0" and env.metadata["is_parallelizable"]
    assert set(env.metadata["render_modes"]) == {"human", "rgb_array", "ansi"}
    assert "render_fps" in env.metadata
    for space_of in (env.observation_space, env.action_space):
        spaces = [space_of(agent) for agent in env.possible_agents]
        assert all(space_of(agent) is space for agent, space in zip(env.possible_agents, spaces))
        assert all(space == spaces[0] for space in spaces) and len({id(space) for space in spaces}) == 3
        assert spaces[0].dtype == np.float32 and len(spaces[0].shape) == 1
        assert np.isfinite(spaces[0].low).all() and np.isfinite(spaces[0].high).all()
    assert env.action_space("benign_0").shape == (3 * 2 + 8,)
    env.close()
    env.close()


def test_pettingzoos_own_tests_pass():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # api_test warns that flat observations are no images
        api_test(trust_env.env("trio", max_cycles=30), num_cycles=200)
        api_test(trust_env.raw_env("case1", "score"), num_cycles=100)
        parallel_api_test(trust_env.parallel_env("case1"), num_cycles=60)
        seed_test(lambda: trust_env.env("case1"), num_cycles=60)
        parallel_seed_test(lambda: trust_env.parallel_env("case1"))


def test_aec_form_gives_the_same_results():
    aec = trust_env.env("trio", "trust", max_cycles=12)
    env = trust_env.parallel_env("trio", "trust", max_cycles=12)
    aec.reset(seed=4)
    env.reset(seed=4)
    rng = np.random.default_rng(4)
    while env.agents:
        actions = random_actions(env, rng)
        for agent in env.agents:
            assert aec.agent_selection == agent
            aec.step(actions[agent])
        observations, rewards, _, truncations, _ = env.step(actions)
        for agent in observations:
            assert (aec.observe(agent) == observations[agent]).all()
            assert aec.rewards[agent] == rewards[agent] and aec.truncations[agent] is truncations[agent]
    assert aec.agents == aec.possible_agents  # dead until each has been stepped with None
    for _ in range(3):
        aec.step(None)
    assert aec.agents == []
