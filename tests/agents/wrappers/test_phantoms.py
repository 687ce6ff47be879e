"""The phantoms wrapper: where phantoms appear, move and end, and what the disc suppresses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, MultiDiscrete
from wrapper_runs import ADVERSARIES, SHAPES, drawn, injected, off_agent, patrol, play, pointing

from trust_env.scenario import Fovs

pytestmark = pytest.mark.core


def test_a_phantom_appears_where_the_policy_points_and_stays() -> None:
    env, wrapper = patrol("phantoms(frame=area)")
    for x, y in ((0.6, 0.0), (-0.6, 0.3), (0.0, -0.9)):
        actions = play(env, wrapper, pointing(x, y))
        np.testing.assert_allclose(actions[0, 0, :3], [1.0, 0.6, 0.0], atol=1e-6)
        assert (actions[0, 0, 3:12:3] <= 0.0).all()
        np.testing.assert_allclose(off_agent(env, 0), [[210.0, 0.0]], atol=1e-3)


def test_a_phantom_is_steered_at_its_speed() -> None:
    env, wrapper = patrol("phantoms(speed=7, frame=area)")
    play(env, wrapper, pointing(0.6, 0.0))
    choices = pointing(0.0, 0.0)
    for frame, (x, y) in enumerate([(-1.0, 0.0), (0.0, 0.5), (0.0, 0.0)]):
        choices[..., 1:3] = x, y
        play(env, wrapper, choices)
        expected = [[203.0, 0.0], [203.0, 3.5], [203.0, 3.5]][frame]
        np.testing.assert_allclose(off_agent(env, 0), [expected], atol=1e-3)


def test_actions_of_zero_place_phantoms_apart() -> None:
    env, wrapper = patrol("phantoms(frame=area)")
    play(env, wrapper, np.zeros((1, 2, 15), dtype=np.float32))
    corner = 350.0 * np.sqrt(0.125)
    corners = [[corner, corner], [-corner, corner], [-corner, -corner], [corner, -corner]]
    np.testing.assert_allclose(off_agent(env, 1), corners, atol=1e-2)


def test_the_edge_of_the_fov_can_be_reached_and_nothing_beyond() -> None:
    for x, y in ((1.0, 0.0), (0.0, -1.0), (1.0, 1.0), (-1.0, 0.7)):
        env, wrapper = patrol("phantoms(frame=area)")
        play(env, wrapper, pointing(x, y))
        np.testing.assert_allclose(off_agent(env, 0)[0], 350.0 * np.array([x, y]) / np.hypot(x, y), atol=1e-2)


@pytest.mark.parametrize("fov", SHAPES)
@pytest.mark.parametrize("wrapper", ["phantoms(frame=area)", "grid(frame=area)"])
def test_injections_are_where_the_wrapper_placed_them_in_any_fov(fov: str, wrapper: str) -> None:
    """The environment moves an injection inside the FOV; where the wrapper's place is inside, they agree."""
    env, built = patrol(wrapper, fov=SHAPES[fov])
    phantoms: Any = built
    reach = env.observation_table.scales.reach[0]
    agreeing = 0
    for frame in range(40):
        choices = drawn(built, 1, frame)
        play(env, built, 0.2 * choices if isinstance(built.action_space, Box) else choices)
        there = phantoms.position[0, 0][phantoms.exists[0, 0]].astype(np.complex128) * reach
        placed = env.arrays.pose[0, 0, :2] + np.stack([there.real, there.imag], axis=-1)
        off = np.linalg.norm(placed - injected(env, 0), axis=-1)
        x, y, heading = env.arrays.pose[0, 0]
        pose = np.array([[x, y, np.cos(heading), np.sin(heading)]])
        inside = Fovs.of(env.scenario, ADVERSARIES[:1]).contains(pose, placed[None])[0]
        assert (off[inside] < 1e-2).all()
        agreeing += int(inside.sum())
    assert agreeing >= 5


def test_a_withdrawn_phantom_disappears_and_can_appear_again() -> None:
    env, wrapper = patrol("phantoms(frame=area)")
    for report, x, reports in ((-0.7, 0.5, 0.5), (-0.9, 0.5, None), (-0.9, 0.2, None), (0.0, -0.9, -0.9)):
        play(env, wrapper, pointing(x, 0.0, report))
        expected = [] if reports is None else [[350.0 * reports, 0.0]]
        np.testing.assert_allclose(off_agent(env, 0).reshape(-1, 2), np.reshape(expected, (-1, 2)), atol=1e-2)
        seen = wrapper.observe(env.arrays.observation[:, ADVERSARIES])[0, 0, -12:-9]
        np.testing.assert_allclose(seen, [0, 0, 0] if reports is None else [0.8 * reports, 0, 1], atol=1e-6)


def test_more_phantoms_than_slots_take_turns() -> None:
    env, wrapper = patrol("phantoms(n=6, frame=area)")
    choices, places = np.zeros((1, 2, 21), dtype=np.float32), []
    for _ in range(5):
        play(env, wrapper, choices)
        places.append(off_agent(env, 0))
    assert [len(p) for p in places] == [4, 2, 4, 2, 4]
    np.testing.assert_array_equal(places[0], places[2])
    np.testing.assert_array_equal(places[1], places[3])
    angles = np.degrees(np.arctan2(*np.concatenate(places[:2]).T[::-1])) % 360
    np.testing.assert_allclose(angles, [30, 90, 150, 210, 270, 330], atol=1e-3)
    choices[..., 0::3][..., :6] = -1.0  # withdrawn, each when its turn comes
    play(env, wrapper, choices)
    there = wrapper.observe(env.arrays.observation[:, ADVERSARIES])[0, 0, -16::3]
    np.testing.assert_array_equal(there, [1, 1, 1, 1, 0, 0])


def test_without_injections_there_is_only_suppression() -> None:
    env, wrapper = patrol("phantoms", injection={"adversary": 0})
    assert wrapper.action_space == Box(-1.0, 1.0, (3,), np.float32)
    assert not play(env, wrapper, np.zeros((1, 2, 3), dtype=np.float32))[..., :12].any()
    env, wrapper = patrol("grid", injection={"slots": 0})
    assert wrapper.action_space == MultiDiscrete([4])
    play(env, wrapper, np.zeros((1, 2, 1), dtype=np.int64))


def test_a_learner_sees_its_phantoms_scaled_as_its_report_is() -> None:
    env, wrapper = patrol("phantoms(frame=area)")
    play(env, wrapper, pointing(0.3, -0.8))
    observation = env.arrays.observation[:, ADVERSARIES]
    field = env.observation_table["report"].slice
    reported = observation[0, 0, field].reshape(-1, 2)[int(env.arrays.report_count[0, 0]) - 1]
    seen = wrapper.observe(observation)[0, 0, -12:].reshape(4, 3)
    np.testing.assert_allclose(seen[0], [*reported, 1.0], atol=1e-6)
    np.testing.assert_array_equal(seen[1:], 0.0)


def test_detections_inside_the_disc_are_suppressed() -> None:
    env, wrapper = patrol("phantoms(frame=area)", sensor={"clutter_density": 4e-5})
    observation = env.arrays.observation[:, ADVERSARIES]
    seen = env.observation_table.read(observation, ADVERSARIES)
    count = int(env.arrays.raw_count[0, 0])
    assert count > 3
    entries = env.action_table["suppressions"]
    off = np.linalg.norm(seen["detections"][0, 0, :count] - seen["pose"][0, 0, :2], axis=-1)
    for radius, metres in ((-1.0, 0.0), (0.0, 0.25 * 1.25 * 350.0), (1.0, 2.5 * 350.0)):
        suppress = wrapper.act(pointing(0.0, 0.0, radius=radius), observation)[0, 0, entries] > 0.0
        np.testing.assert_array_equal(suppress[:count], off < metres)
    choices = pointing(0.0, 0.0, radius=-0.6)  # 2 * 0.2^3 = 0.016 REACH radii, or 7 m, about one detection
    choices[0, 0, 12:14] = (seen["detections"] - seen["pose"][..., None, :2])[0, 0, 1] / 350.0
    suppress = wrapper.act(choices, observation)[0, 0, entries] > 0.0
    near = np.linalg.norm(seen["detections"][0, 0, :count] - seen["detections"][0, 0, 1], axis=-1) < 7.0
    np.testing.assert_array_equal(suppress[:count], near)
    assert near.sum() == 1
