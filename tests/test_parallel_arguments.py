"""The PettingZoo face: valid arguments and actions in any form, and errors for all others."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from parallel_envs import play, random_actions, snapshot, zero_actions

import trust_env


def invalid_actions(actions: dict[str, np.ndarray]) -> list[tuple[Any, str]]:
    """What a caller may pass by mistake, and the words of the error."""
    size = len(actions["benign_0"])
    one_nan, one_inf = np.zeros(size), np.zeros(size, np.float32)
    one_nan[3], one_inf[-1] = np.nan, -np.inf
    wrong_shapes = [np.zeros(size - 1, np.float32), np.zeros((1, size), np.float32), np.zeros((size, 1)), 0.0]
    wrong_types = [None, "fire", ["a"] * size, np.array(["0.5"] * size), np.zeros(size, complex)]
    wrong_types += [np.array([None] * size), {"x": 1}, [[0.0] * size, [0.0]]]
    without = {agent: action for agent, action in actions.items() if agent != "benign_0"}
    return [
        (actions | {"benign_0": one_nan}, "benign_0.*finite.*entry 3.*nan"),
        (actions | {"adversary_0": one_inf}, rf"adversary_0.*finite.*entry {size - 1}.*-inf"),
        *((actions | {"benign_0": wrong}, f"benign_0.*{size}") for wrong in wrong_shapes + wrong_types),
        (without, "missing: benign_0"),
        ({}, "missing: adversary_0, benign_0"),
        (actions | {"benign_7": actions["benign_0"]}, "unknown: benign_7"),
        (without | {"benign_7": actions["benign_0"]}, "benign_7"),
        (None, "adversary_0"),
        (list(actions.values()), "adversary_0"),
    ]


@pytest.mark.core
def test_invalid_actions_raise_naming_the_agent_and_change_nothing():
    env = trust_env.parallel_env("trio", "trust")
    env.reset(seed=5)
    rng = np.random.default_rng(5)
    for _ in range(5):
        env.step(random_actions(env, rng))
    before, actions = snapshot(env), random_actions(env, rng)
    for wrong, message in invalid_actions(actions):
        with pytest.raises(ValueError, match=message):
            env.step(wrong)
        assert snapshot(env) == before, message
    twin = copy.deepcopy(env)
    assert play(env, np.random.default_rng(6), 5) == play(twin, np.random.default_rng(6), 5)


@pytest.mark.core
def test_finite_actions_of_any_type_are_clipped_alike():
    """Lists, float32, float64 beyond float32's range: as if clipped to the space."""
    rng = np.random.default_rng(6)
    envs = [trust_env.parallel_env("trio", "trust") for _ in range(4)]
    for env in envs:
        env.reset(seed=6)
    for _ in range(15):
        size = envs[0].action_space("benign_0").shape
        huge = {a: rng.choice([-1e300, -2.0, -0.5, 0.0, 0.5, 7.0, 1e300], size) for a in envs[0].agents}
        clipped = {a: np.clip(v, -1, 1) for a, v in huge.items()}
        lists = {a: v.tolist() for a, v in huge.items()}
        singles = {a: v.astype(np.float32) for a, v in clipped.items()}
        results = []
        for env, actions in zip(envs, (huge, clipped, lists, singles), strict=True):
            observations, *_ = env.step(actions)
            results.append({a: o.tobytes() for a, o in observations.items()})
            assert all(env.observation_space(a).contains(o) for a, o in observations.items())
        assert results[0] == results[1] == results[2] == results[3]


def test_results_do_not_depend_on_the_order_of_the_actions():
    envs = [trust_env.parallel_env("trio", "trust") for _ in range(2)]
    for env in envs:
        env.reset(seed=3)
    for _ in range(10):
        actions = random_actions(envs[0], np.random.default_rng(envs[0].arrays.frame[0].item()))
        reordered = dict(reversed(actions.items()))
        first, second = envs[0].step(actions), envs[1].step(reordered)
        assert list(first[0]) == list(second[0]) == envs[0].possible_agents
        assert first[1:] == second[1:] and snapshot(envs[0]) == snapshot(envs[1])


def test_step_before_reset_or_after_the_end_raises_and_changes_nothing():
    env = trust_env.parallel_env("case1", max_cycles=2)
    with pytest.raises(RuntimeError, match="reset"):
        env.step({})
    env.reset(seed=0)
    for _ in range(2):
        env.step(zero_actions(env))
    before = snapshot(env)
    for actions in ({}, {"benign_0": np.zeros(14)}):
        with pytest.raises(RuntimeError, match=r"over.*reset"):
            env.step(actions)
    assert snapshot(env) == before
    env.reset()
    assert env.agents == env.possible_agents


def test_step_changes_neither_its_actions_nor_earlier_observations():
    env = trust_env.parallel_env("trio")
    observations, _ = env.reset(seed=7)
    copies = {a: o.copy() for a, o in observations.items()}
    actions = random_actions(env, np.random.default_rng(7))
    given = {a: v.copy() for a, v in actions.items()}
    env.step(actions)
    for agent in actions:
        assert np.array_equal(actions[agent], given[agent])
        assert np.array_equal(observations[agent], copies[agent])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scenario": "patroll"}, "patrol"),
        ({"scenario": "case3"}, "case"),
        ({"defense": "thrust"}, "trust"),
        ({"defense": "trust(preset=papper)"}, "paper"),
        ({"defense": "trust(presset=paper)"}, "switch|presset"),
        ({"defense": "majority(window=0)"}, "window"),
        ({"defense": "majority(windw=3)"}, "windw"),
        ({"defense": "trust(agent_priors={9: (0.8, 10)})"}, "agent 9"),
        ({"scenario": "patrol(horizn=3)"}, "horizon"),
        ({"render_mode": "rgb"}, "rgb_array"),
        ({"max_cycles": 0}, "max_cycles"),
        ({"max_cycles": 2.5}, "max_cycles"),
    ],
)
def test_errors_of_arguments_name_what_was_expected(arguments, message):
    with pytest.raises(ValueError, match=message):
        trust_env.parallel_env(**arguments)


@pytest.mark.parametrize("defense", [object(), 5, None, dict, type("Half", (), {"reset": lambda *a: None})()])
def test_objects_that_are_no_defense_raise(defense):
    with pytest.raises(TypeError, match="a defense is a name, or an object"):
        trust_env.parallel_env("case1", defense)
