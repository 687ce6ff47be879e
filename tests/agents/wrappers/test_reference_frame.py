"""The outward reference frame: what is seen and done in it."""

from __future__ import annotations

import numpy as np
import pytest
from wrapper_runs import ADVERSARIES, injected, patrol, play, pointing, reset_wrapper

pytestmark = pytest.mark.core


@pytest.mark.parametrize("wrapper", ["phantoms", "grid(g=3)"])
def test_the_outward_frame_rotates_observations(wrapper: str) -> None:
    """The x axis points from the middle of the area to the agent: what it sees there is turned back."""
    env, outward = patrol(wrapper, knowledge="poses")
    area = reset_wrapper(f"{wrapper[:-1]}, frame=area)" if "(" in wrapper else f"{wrapper}(frame=area)", env)
    observation = env.arrays.observation[:, ADVERSARIES]
    turned, plain = outward.observe(observation), area.observe(observation)
    pose = env.arrays.pose[0, :, :2]
    turn = np.exp(-1j * np.arctan2(pose[:2, 1], pose[:2, 0]))
    start = dict(zip(outward.fields, np.cumsum([0, *outward.fields.values()])))
    for name, pairs in (("pose", 2), ("detections", 16), ("poses", 10)):
        field = slice(start[name], start[name] + 2 * pairs)
        expected = plain[0, :, field].reshape(2, pairs, 2) @ [1.0, 1.0j] * turn[:, None]
        np.testing.assert_allclose(turned[0, :, field].reshape(2, pairs, 2) @ [1.0, 1.0j], expected, atol=1e-6)
    np.testing.assert_allclose(turned[0, :, start["pose"]], np.hypot(*pose[:2].T) / 850.0, atol=1e-6)
    np.testing.assert_array_equal(turned[..., start["fovs"] :], plain[..., start["fovs"] :])


def test_outward_phantoms_are_placed_away_from_the_middle_of_the_area() -> None:
    env, wrapper = patrol("phantoms")
    play(env, wrapper, pointing(1.0, 0.0))
    for k in ADVERSARIES:
        pose = env.arrays.pose[0, k, :2]
        np.testing.assert_allclose(injected(env, k), [pose * (1.0 + 350.0 / np.hypot(*pose))], atol=1e-2)
    np.testing.assert_allclose(wrapper.observe(env.arrays.observation[:, ADVERSARIES])[0, :, -12], 0.8, atol=1e-5)
