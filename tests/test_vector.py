"""The batched face: arrays in, arrays out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trust_env


@pytest.mark.core
@pytest.mark.parametrize("defense", ["trust", "score"])
def test_every_step_returns_arrays_of_the_promised_shapes_and_types(defense):
    venv = trust_env.vector_env("trio", defense, num_worlds=5, max_cycles=7)
    observations, info = venv.reset(seed=2)
    w, k = 5, len(venv.possible_agents)
    o, a = venv.single_observation_space.shape[0], venv.single_action_space.shape[0]
    keys, rng = set(info), np.random.default_rng(2)
    for frame in range(1, 30):
        assert observations.shape == (w, k, o) and observations.dtype == np.float32
        assert np.isfinite(observations).all() and np.abs(observations).max() <= 1.0
        observations, rewards, terminated, truncated, info = venv.step(rng.uniform(-2, 2, (w, k, a)))
        assert rewards.shape == (w, k) and rewards.dtype == np.float64 and np.isfinite(rewards).all()
        assert terminated.shape == truncated.shape == (w,) and terminated.dtype == truncated.dtype == bool
        over = frame % 7 == 0
        assert not terminated.any() and (truncated == over).all()
        assert set(info) == (keys | {"final_obs"} if over else keys)
        assert info["agent_trust"].shape == (w, k)
        per_world = info.keys() - {"agent_trust", "final_obs"}
        assert all(info[name].shape == (w,) for name in per_world)
        assert (info["frame"] == ((frame - 1) % 7) + 1).all() and (info["episode"] == (frame - 1) // 7).all()
        if over:
            final = venv.observation_table.read(info["final_obs"], np.arange(k))
            begin = venv.observation_table.read(observations, np.arange(k))
            assert (final["time"] == 1).all() and (begin["time"] == 0).all()
            assert (venv.arrays.track_status == 0).all()


def test_without_autoreset_worlds_stay_at_the_end_of_their_episode():
    venv = trust_env.vector_env("trio", "trust", num_worlds=2, max_cycles=3, autoreset=False)
    venv.reset(seed=1)
    for frame in range(1, 4):
        _, _, _, truncated, info = venv.step(np.zeros(venv.arrays.action.shape))
        assert truncated.tolist() == [frame == 3] * 2 and "final_obs" not in info
    assert venv.arrays.episode.tolist() == [0, 0]


def test_only_worlds_whose_episode_ended_are_reset():
    venv = trust_env.vector_env("trio", "trust", num_worlds=3, max_cycles=6)
    alone = trust_env.vector_env("trio", "trust", num_worlds=3, max_cycles=6)
    venv.reset(seed=3)
    alone.reset(seed=3)
    venv.arrays.frame[...] = [0, 2, 4]
    truncated = np.zeros(3, dtype=bool)
    for _ in range(2):
        _, _, _, truncated, _ = venv.step(np.zeros(venv.arrays.action.shape))
        alone.step(np.zeros(venv.arrays.action.shape))
    assert truncated.tolist() == [False, False, True]
    assert venv.arrays.episode.tolist() == [0, 0, 1] and venv.arrays.frame.tolist() == [2, 4, 0]
    assert np.array_equal(venv.arrays.track_score[0], alone.arrays.track_score[0])


def invalid_batches(shape: tuple[int, ...]) -> list[tuple[Any, str]]:
    one_nan = np.zeros(shape)
    one_nan[1, 0, 2] = np.nan
    return [
        (one_nan, "world 1, adversary_0, entry 2"),
        (np.full(shape, np.inf), "finite"),
        (np.zeros(shape[1:]), "shape"),
        (np.zeros((*shape, 1)), "shape"),
        (np.zeros(shape, complex), "numbers"),
        (np.full(shape, "a"), "numbers"),
        (None, "numbers"),
        (np.full(shape, None), "numbers"),
    ]


@pytest.mark.core
def test_invalid_batches_raise_and_change_nothing():
    venv = trust_env.vector_env("trio", "trust", num_worlds=2)
    with pytest.raises(RuntimeError, match="reset"):
        venv.step(np.zeros(venv.arrays.action.shape))
    venv.reset(seed=4)
    for _ in range(3):
        venv.step(np.ones(venv.arrays.action.shape))
    before = venv.worlds.rows.copy()
    for actions, message in invalid_batches(venv.arrays.action.shape):
        with pytest.raises(ValueError, match=message):
            venv.step(actions)
        assert np.array_equal(venv.worlds.rows, before)


INVALID_OPTIONS = [
    {"worlds": [0]},
    {"worlds": [-1, 0]},
    {"worlds": 3},
    {"episodes": [0.5, 1.0]},
    {"episodes": [0, 2**32]},
]


@pytest.mark.parametrize("options", INVALID_OPTIONS)
def test_invalid_options_raise_and_change_nothing(options):
    venv = trust_env.vector_env("trio", "trust", num_worlds=2)
    venv.reset(seed=4)
    for _ in range(3):
        venv.step(np.ones(venv.arrays.action.shape))
    before = venv.worlds.rows.copy()
    for seed in (None, 9):
        with pytest.raises(ValueError, match=r"option '(worlds|episodes)'"):
            venv.reset(seed=seed, options=options)
        assert np.array_equal(venv.worlds.rows, before)


@pytest.mark.parametrize(
    "arguments",
    [{"num_worlds": 0}, {"num_worlds": 1.5}, {"threads": -1}, {"max_cycles": "3"}, {"num_worlds": True}],
)
def test_numbers_that_are_not_whole_or_below_one_raise(arguments):
    with pytest.raises(ValueError, match="must be a whole number of at least 1"):
        trust_env.vector_env("trio", **arguments)
