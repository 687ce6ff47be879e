"""The grid wrapper: what each choice does."""

from __future__ import annotations

import numpy as np
import pytest
from wrapper_runs import ADVERSARIES, off_agent, patrol, play

pytestmark = pytest.mark.core


def chosen(first: int, suppress: int = 0) -> np.ndarray:
    """Choices for both adversaries of patrol in one world: what becomes of the first phantom, else kept."""
    choices = np.zeros((1, 2, 5), dtype=np.int64)
    choices[..., 0], choices[..., 4] = first, suppress
    return choices


def test_grid_choices_place_keep_and_withdraw_a_phantom() -> None:
    env, wrapper = patrol("grid(g=5, frame=area)")
    for choice, expected in (
        (0, []),  # there is nothing to keep
        (2 + 5 * 4 + 2, [[350.0, 0.0]]),  # the highest x, the middle of y
        (0, [[350.0, 0.0]]),
        (2 + 5 * 0 + 2, [[350.0, 0.0]]),
        (1, []),
        (2 + 5 * 1 + 3, [[-175.0, 175.0]]),
        (1, []),
        (2 + 5 * 2 + 0, [[0.0, -350.0]]),  # the lowest y
    ):
        play(env, wrapper, chosen(choice))
        np.testing.assert_allclose(off_agent(env, 0).reshape(-1, 2), np.reshape(expected, (-1, 2)), atol=1e-2)


def test_grid_points_steer_phantoms_that_have_a_speed() -> None:
    env, wrapper = patrol("grid(g=5, speed=4, frame=area)")
    for choice, x in ((2 + 5 * 3 + 2, 175.0), (2 + 5 * 0 + 2, 171.0), (0, 171.0), (2 + 5 * 1 + 2, 169.0)):
        play(env, wrapper, chosen(choice))
        np.testing.assert_allclose(off_agent(env, 0), [[x, 0.0]], atol=1e-3)


def test_grid_suppresses_none_near_far_or_all() -> None:
    env, wrapper = patrol("grid(frame=area)", sensor={"clutter_density": 4e-5})
    observation = env.arrays.observation[:, ADVERSARIES]
    seen, count = env.observation_table.read(observation, ADVERSARIES), int(env.arrays.raw_count[0, 0])
    off = np.linalg.norm(seen["detections"][0, 0, :count] - seen["pose"][0, 0, :2], axis=-1)
    near = off < 350.0 * np.sqrt(0.5)
    assert near.any() and not near.all()
    for choice, expected in enumerate((near & False, near, ~near, near | True)):
        actions = wrapper.act(chosen(0, choice), observation)[0, 0, env.action_table["suppressions"]]
        np.testing.assert_array_equal(actions[:count] > 0.0, expected)
