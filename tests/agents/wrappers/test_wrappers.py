"""All wrappers: their spaces, batches, knowledge levels and errors."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium.spaces import Box, MultiDiscrete
from wrapper_runs import ADVERSARIES, VARIANTS, drawn, patrol, play, pointing, reset_wrapper

from trust_env.agents import PolicyContext
from trust_env.agents.wrappers import DEFAULT_WRAPPER, WRAPPERS, build_wrapper

pytestmark = pytest.mark.core


@pytest.mark.parametrize("wrapper", VARIANTS)
@pytest.mark.parametrize("knowledge", ["own", "white_box"])
def test_observations_and_actions_stay_in_their_spaces(wrapper: str, knowledge: str) -> None:
    env, built = patrol(wrapper, 3, knowledge=knowledge)
    assert repr(build_wrapper(str(built))) == str(built)
    for frame in range(30):
        seen = built.observe(env.arrays.observation[:, ADVERSARIES])
        assert seen.shape == (3, 2, built.observation_size) and seen.dtype == np.float32
        assert np.abs(seen).max() <= 1.0
        actions = play(env, built, drawn(built, 3, frame))
        assert actions.shape == (3, 2, 28) and actions.dtype == np.float32
        assert np.abs(actions).max() <= 1.0


def test_spaces_have_the_sizes_of_the_scenario() -> None:
    assert DEFAULT_WRAPPER in WRAPPERS
    _, phantoms = patrol("phantoms")
    assert phantoms.action_space == Box(-1.0, 1.0, (15,), np.float32)  # four phantoms and the disc
    fields = {"time": 1, "pose": 4, "detections": 32, "detections_mask": 16}
    assert phantoms.fields == fields
    assert phantoms.observation_size == sum(fields.values()) + 12
    _, grid = patrol("grid(g=3, n=2)")
    assert grid.action_space == MultiDiscrete([11, 11, 4])
    env, raw = patrol("raw")
    assert (raw.action_space, raw.observation_size) == (env.single_action_space, env.observation_table.size)


def test_raw_changes_neither_observations_nor_actions() -> None:
    env, raw = patrol("raw", 2)
    observations, choices = env.arrays.observation[:, ADVERSARIES], drawn(raw, 2, 0)
    np.testing.assert_array_equal(raw.observe(observations), observations)
    np.testing.assert_array_equal(raw.act(choices, observations), choices)


@pytest.mark.parametrize("wrapper", VARIANTS)
def test_actions_do_not_depend_on_the_batch_or_on_a_snapshot(wrapper: str) -> None:
    many, in_batch = patrol(wrapper, 4)
    one, alone = patrol(wrapper)
    one.reset(7, options={"worlds": np.array([2]), "episodes": np.array([0])})
    for frame in range(12):
        choices = drawn(in_batch, 4, frame)
        actions = play(many, in_batch, choices)
        np.testing.assert_array_equal(play(one, alone, choices[2:3])[0], actions[2])
        if frame == 6:
            state, alone = alone.get_state(), reset_wrapper(wrapper, one)
            alone.set_state(state)


def test_only_worlds_that_begin_an_episode_lose_their_phantoms() -> None:
    env, wrapper = patrol("phantoms", 2)
    observation = env.arrays.observation[:, ADVERSARIES]
    wrapper.act(np.repeat(pointing(0.5, 0.5), 2, axis=0), observation)
    before = wrapper.observe(observation)[:, 0, -12:]
    c = wrapper.context
    mask = np.array([False, True])
    wrapper.reset(PolicyContext(c.scenario, c.observation_table, c.agents, 1, c.worlds, c.episodes + 1, mask))
    after = wrapper.observe(observation)[:, 0, -12:]
    np.testing.assert_array_equal(after[0], before[0])
    assert before[1].any() and not after[1].any()


@pytest.mark.parametrize(
    ("wrapper", "message"),
    [
        ("phantom", "unknown wrapper 'phantom'; did you mean 'phantoms'"),
        ("phantoms(m=3)", "wrapper 'phantoms' has no parameter 'm'.*n, speed, frame, knowledge"),
        ("phantoms(n=0)", "phantoms: n = 0: expected a whole number of at least 1"),
        ("phantoms(speed=-1)", r"phantoms: speed = -1: expected a number of at least 0 \(m/s\)"),
        ("phantoms(frame=out)", "phantoms: frame = 'out': expected one of area, outward"),
        ("grid(g=1)", "grid: g = 1: expected a whole number of at least 2"),
        ("raw(knowledge=all)", "raw: knowledge = 'all': expected one of own, poses"),
        ("my_wrappers.py:Mine", "unknown wrapper 'my_wrappers.py:Mine'"),
    ],
)
def test_unknown_names_and_parameters_raise(wrapper: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        build_wrapper(wrapper)


def test_what_does_not_fit_the_scenario_raises() -> None:
    with pytest.raises(ValueError, match="phantoms: n = 9: expected at most 8, 2 by turns in each of 4"):
        patrol("phantoms(n=9)")
    with pytest.raises(ValueError, match="grid: knowledge = 'poses': expected at most own"):
        patrol("grid(knowledge=poses)")
    with pytest.raises(TypeError, match="a wrapper is a name"):
        build_wrapper(3)
    with pytest.raises(RuntimeError, match=r"call reset\(context\) first"):
        _ = build_wrapper("raw").context
    _, wrapper = patrol("phantoms")
    _, other = patrol("phantoms", 2)
    with pytest.raises(ValueError, match=r"position = 'complex64\[2, 2, 4\]': expected complex64\[1, 2, 4\]"):
        wrapper.set_state(other.get_state())


@pytest.mark.parametrize("wrapper", WRAPPERS)
def test_more_knowledge_does_not_change_what_a_wrapper_shows_and_does(wrapper: str) -> None:
    env, own = patrol(wrapper)
    rich, same = patrol(str(own), knowledge="white_box", coordination="none")
    assert same.fields == own.fields
    for frame in range(5):
        seen = own.observe(env.arrays.observation[:, ADVERSARIES])
        np.testing.assert_array_equal(seen, same.observe(rich.arrays.observation[:, ADVERSARIES]))
        choices = drawn(own, 1, frame)
        np.testing.assert_array_equal(play(env, own, choices), play(rich, same, choices))
