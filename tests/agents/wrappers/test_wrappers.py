"""Action views: places and frames worked out by hand, what the environment then reports, and what is seen."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, MultiDiscrete

from trust_env.agents import PolicyContext
from trust_env.agents.wrappers import DEFAULT_VIEW, VIEWS, View, build_view
from trust_env.scenario import Fovs, load_scenario
from trust_env.vector import VectorEnv, vector_env
from trust_env.world.origin import FIRST_INJECTION

pytestmark = pytest.mark.core

VARIANTS = [*VIEWS, "phantoms(n=2, speed=0, frame=area)", "grid(g=3, n=7, speed=5, frame=area)"]
SHAPES: dict[str, Any] = {
    "circle": {"radius": 350.0},
    "sector": {"type": "sector", "radius": 400.0, "heading": 0.7, "width": 1.9},
    "triangle": {"type": "polygon", "vertices": [[-100.0, -50.0], [50.0, 300.0], [350.0, -20.0]]},
}
ADVERSARIES = np.array([0, 1])  # of patrol


def begun(view: Any, env: VectorEnv, agents: np.ndarray = ADVERSARIES) -> View:
    """The view for agents of an environment that has just been reset."""
    worlds = env.arrays.world_id.reshape(-1).copy()
    mask, episodes = np.ones(len(worlds), dtype=bool), np.zeros_like(worlds)
    made = build_view(view)
    made.reset(PolicyContext(env.scenario, env.observation_table, agents, 1, worlds, episodes, mask))
    return made


def patrol(view: Any, num_worlds: int = 1, **overrides: Any) -> tuple[VectorEnv, View]:
    env = vector_env(load_scenario("patrol", **overrides), "score", num_worlds, autoreset=False)
    env.reset(7)
    return env, begun(view, env)


def play(env: VectorEnv, view: View, choices: np.ndarray) -> np.ndarray:
    """A frame in which the adversaries choose; their raw actions."""
    observations = env.arrays.observation[:, ADVERSARIES]
    actions, chosen = np.zeros_like(env.arrays.action), view.act(choices, observations)
    actions[:, ADVERSARIES] = chosen
    env.step(actions)
    return chosen


def drawn(view: View, worlds: int, seed: int) -> np.ndarray:
    """Choices of every learner, uniform in the action space."""
    space = copy.deepcopy(view.action_space)
    space.seed(seed)
    return np.array([[space.sample() for _ in ADVERSARIES] for _ in range(worlds)])


def injected(env: VectorEnv, k: int) -> np.ndarray:
    """Where agent k of world 0 injected in the last frame, [n, 2] m."""
    count = int(env.arrays.report_count[0, k])
    mine = env.arrays.report_origin[0, k, :count] <= FIRST_INJECTION
    return env.arrays.report_detections[0, k, :count][mine]


@pytest.mark.parametrize("view", VARIANTS)
@pytest.mark.parametrize("knowledge", ["own", "white_box"])
def test_all_views_keep_to_their_spaces(view: str, knowledge: str) -> None:
    env, made = patrol(view, 3, knowledge=knowledge)
    assert repr(build_view(str(made))) == str(made)
    for frame in range(30):
        seen = made.observe(env.arrays.observation[:, ADVERSARIES])
        assert seen.shape == (3, 2, made.observation_size) and seen.dtype == np.float32
        assert np.abs(seen).max() <= 1.0
        actions = play(env, made, drawn(made, 3, frame))
        assert actions.shape == (3, 2, 28) and actions.dtype == np.float32
        assert np.abs(actions).max() <= 1.0


def test_default_view_is_registered_and_sizes_follow_the_scenario() -> None:
    assert DEFAULT_VIEW in VIEWS
    _, phantoms = patrol("phantoms")
    assert phantoms.action_space == Box(-1.0, 1.0, (15,), np.float32)  # four phantoms and the disc
    fields = {"time": 1, "pose": 4, "detections": 32, "detections_mask": 16}
    assert phantoms.fields == fields
    assert phantoms.observation_size == sum(fields.values()) + 12
    _, grid = patrol("grid(g=3, n=2)")
    assert grid.action_space == MultiDiscrete([11, 11, 4])
    env, raw = patrol("raw")
    assert (raw.action_space, raw.observation_size) == (env.single_action_space, env.observation_table.size)


def test_raw_view_changes_nothing() -> None:
    env, raw = patrol("raw", 2)
    observations, choices = env.arrays.observation[:, ADVERSARIES], drawn(raw, 2, 0)
    np.testing.assert_array_equal(raw.observe(observations), observations)
    np.testing.assert_array_equal(raw.act(choices, observations), choices)


# --- phantoms ---


def pointing(x: float, y: float, report: float = 1.0, radius: float = -1.0) -> np.ndarray:
    """Choices for both adversaries of patrol in one world: only their first phantom is there. It appears at
    (x, y) FOV radii, its own point being (1, 1) / sqrt(8).
    """
    choices = np.zeros((1, 2, 15), dtype=np.float32)
    choices[..., 0:12:3] = -1.0
    choices[..., 0], choices[..., 1:3] = report, (np.array([x, y]) - np.sqrt(0.125)) / 3.0
    choices[..., 12:] = 0.0, 0.0, radius
    return choices


def off_agent(env: VectorEnv, k: int) -> np.ndarray:
    """Where agent k of world 0 injected in the last frame, relative to it: [n, 2] m."""
    return injected(env, k) - env.arrays.pose[0, k, :2]


def test_a_phantom_appears_where_the_policy_points_and_stays() -> None:
    env, view = patrol("phantoms(frame=area)")
    for x, y in ((0.6, 0.0), (-0.6, 0.3), (0.0, -0.9)):
        actions = play(env, view, pointing(x, y))
        np.testing.assert_allclose(actions[0, 0, :3], [1.0, 0.6, 0.0], atol=1e-6)
        assert (actions[0, 0, 3:12:3] <= 0.0).all()
        np.testing.assert_allclose(off_agent(env, 0), [[210.0, 0.0]], atol=1e-3)


def test_a_phantom_is_steered_at_its_speed() -> None:
    env, view = patrol("phantoms(speed=7, frame=area)")
    play(env, view, pointing(0.6, 0.0))
    choices = pointing(0.0, 0.0)
    for frame, (x, y) in enumerate([(-1.0, 0.0), (0.0, 0.5), (0.0, 0.0)]):
        choices[..., 1:3] = x, y
        play(env, view, choices)
        expected = [[203.0, 0.0], [203.0, 3.5], [203.0, 3.5]][frame]
        np.testing.assert_allclose(off_agent(env, 0), [expected], atol=1e-3)


def test_actions_of_zero_place_phantoms_apart() -> None:
    env, view = patrol("phantoms(frame=area)")
    play(env, view, np.zeros((1, 2, 15), dtype=np.float32))
    corner = 350.0 * np.sqrt(0.125)
    corners = [[corner, corner], [-corner, corner], [-corner, -corner], [corner, -corner]]
    np.testing.assert_allclose(off_agent(env, 1), corners, atol=1e-2)


def test_the_edge_of_the_fov_can_be_reached_and_nothing_beyond() -> None:
    for x, y in ((1.0, 0.0), (0.0, -1.0), (1.0, 1.0), (-1.0, 0.7)):
        env, view = patrol("phantoms(frame=area)")
        play(env, view, pointing(x, y))
        np.testing.assert_allclose(off_agent(env, 0)[0], 350.0 * np.array([x, y]) / np.hypot(x, y), atol=1e-2)


@pytest.mark.parametrize("fov", SHAPES)
@pytest.mark.parametrize("view", ["phantoms(frame=area)", "grid(frame=area)"])
def test_any_fov_reports_what_the_view_has_placed(fov: str, view: str) -> None:
    """The environment moves an injection inside the FOV; where the view's place is inside, they agree."""
    env, made = patrol(view, fov=SHAPES[fov])
    made_phantoms: Any = made
    reach = env.observation_table.scales.reach[0]
    agreeing = 0
    for frame in range(40):
        choices = drawn(made, 1, frame)
        play(env, made, 0.2 * choices if isinstance(made.action_space, Box) else choices)
        there = made_phantoms.place[0, 0][made_phantoms.there[0, 0]].astype(np.complex128) * reach
        placed = env.arrays.pose[0, 0, :2] + np.stack([there.real, there.imag], axis=-1)
        off = np.linalg.norm(placed - injected(env, 0), axis=-1)
        x, y, heading = env.arrays.pose[0, 0]
        pose = np.array([[x, y, np.cos(heading), np.sin(heading)]])
        inside = Fovs.of(env.scenario, ADVERSARIES[:1]).contains(pose, placed[None])[0]
        assert (off[inside] < 1e-2).all()
        agreeing += int(inside.sum())
    assert agreeing >= 5


def test_a_withdrawn_phantom_is_gone_and_appears_anew() -> None:
    env, view = patrol("phantoms(frame=area)")
    for report, x, reports in ((-0.7, 0.5, 0.5), (-0.9, 0.5, None), (-0.9, 0.2, None), (0.0, -0.9, -0.9)):
        play(env, view, pointing(x, 0.0, report))
        expected = [] if reports is None else [[350.0 * reports, 0.0]]
        np.testing.assert_allclose(off_agent(env, 0).reshape(-1, 2), np.reshape(expected, (-1, 2)), atol=1e-2)
        seen = view.observe(env.arrays.observation[:, ADVERSARIES])[0, 0, -12:-9]
        np.testing.assert_allclose(seen, [0, 0, 0] if reports is None else [0.8 * reports, 0, 1], atol=1e-6)


def test_more_phantoms_than_slots_take_turns() -> None:
    env, view = patrol("phantoms(n=6, frame=area)")
    choices, places = np.zeros((1, 2, 21), dtype=np.float32), []
    for _ in range(5):
        play(env, view, choices)
        places.append(off_agent(env, 0))
    assert [len(p) for p in places] == [4, 2, 4, 2, 4]
    np.testing.assert_array_equal(places[0], places[2])
    np.testing.assert_array_equal(places[1], places[3])
    angles = np.degrees(np.arctan2(*np.concatenate(places[:2]).T[::-1])) % 360
    np.testing.assert_allclose(angles, [30, 90, 150, 210, 270, 330], atol=1e-3)
    choices[..., 0::3][..., :6] = -1.0  # withdrawn, each when its turn comes
    play(env, view, choices)
    there = view.observe(env.arrays.observation[:, ADVERSARIES])[0, 0, -16::3]
    np.testing.assert_array_equal(there, [1, 1, 1, 1, 0, 0])


def test_without_injections_there_is_only_suppression() -> None:
    env, view = patrol("phantoms", injection={"adversary": 0})
    assert view.action_space == Box(-1.0, 1.0, (3,), np.float32)
    assert not play(env, view, np.zeros((1, 2, 3), dtype=np.float32))[..., :12].any()
    env, view = patrol("grid", injection={"slots": 0})
    assert view.action_space == MultiDiscrete([4])
    play(env, view, np.zeros((1, 2, 1), dtype=np.int64))


def test_a_learner_sees_its_phantoms_scaled_as_its_report_is() -> None:
    env, view = patrol("phantoms(frame=area)")
    play(env, view, pointing(0.3, -0.8))
    observation = env.arrays.observation[:, ADVERSARIES]
    field = env.observation_table["report"].slice
    reported = observation[0, 0, field].reshape(-1, 2)[int(env.arrays.report_count[0, 0]) - 1]
    seen = view.observe(observation)[0, 0, -12:].reshape(4, 3)
    np.testing.assert_allclose(seen[0], [*reported, 1.0], atol=1e-6)
    np.testing.assert_array_equal(seen[1:], 0.0)


def test_suppression_disc() -> None:
    env, view = patrol("phantoms(frame=area)", sensor={"clutter_density": 4e-5})
    observation = env.arrays.observation[:, ADVERSARIES]
    seen = env.observation_table.read(observation, ADVERSARIES)
    count = int(env.arrays.raw_count[0, 0])
    assert count > 3
    entries = env.action_table["suppressions"]
    off = np.linalg.norm(seen["detections"][0, 0, :count] - seen["pose"][0, 0, :2], axis=-1)
    for radius, metres in ((-1.0, 0.0), (0.0, 0.25 * 1.25 * 350.0), (1.0, 2.5 * 350.0)):
        suppress = view.act(pointing(0.0, 0.0, radius=radius), observation)[0, 0, entries] > 0.0
        np.testing.assert_array_equal(suppress[:count], off < metres)
    choices = pointing(0.0, 0.0, radius=-0.6)  # 2 * 0.2^3 = 0.016 REACH radii, or 7 m, about one detection
    choices[0, 0, 12:14] = (seen["detections"] - seen["pose"][..., None, :2])[0, 0, 1] / 350.0
    suppress = view.act(choices, observation)[0, 0, entries] > 0.0
    near = np.linalg.norm(seen["detections"][0, 0, :count] - seen["detections"][0, 0, 1], axis=-1) < 7.0
    np.testing.assert_array_equal(suppress[:count], near)
    assert near.sum() == 1


# --- grid ---


def chosen(first: int, suppress: int = 0) -> np.ndarray:
    """Choices for both adversaries of patrol in one world: what becomes of the first phantom, else kept."""
    choices = np.zeros((1, 2, 5), dtype=np.int64)
    choices[..., 0], choices[..., 4] = first, suppress
    return choices


def test_grid_points_keep_and_withdraw() -> None:
    env, view = patrol("grid(g=5, frame=area)")
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
        play(env, view, chosen(choice))
        np.testing.assert_allclose(off_agent(env, 0).reshape(-1, 2), np.reshape(expected, (-1, 2)), atol=1e-2)


def test_grid_points_steer_where_there_is_speed() -> None:
    env, view = patrol("grid(g=5, speed=4, frame=area)")
    for choice, x in ((2 + 5 * 3 + 2, 175.0), (2 + 5 * 0 + 2, 171.0), (0, 171.0), (2 + 5 * 1 + 2, 169.0)):
        play(env, view, chosen(choice))
        np.testing.assert_allclose(off_agent(env, 0), [[x, 0.0]], atol=1e-3)


def test_grid_suppresses_none_near_far_or_all() -> None:
    env, view = patrol("grid(frame=area)", sensor={"clutter_density": 4e-5})
    observation = env.arrays.observation[:, ADVERSARIES]
    seen, count = env.observation_table.read(observation, ADVERSARIES), int(env.arrays.raw_count[0, 0])
    off = np.linalg.norm(seen["detections"][0, 0, :count] - seen["pose"][0, 0, :2], axis=-1)
    near = off < 350.0 * np.sqrt(0.5)
    assert near.any() and not near.all()
    for choice, expected in enumerate((near & False, near, ~near, near | True)):
        actions = view.act(chosen(0, choice), observation)[0, 0, env.action_table["suppressions"]]
        np.testing.assert_array_equal(actions[:count] > 0.0, expected)


# --- what learners see, and in what batch ---


@pytest.mark.parametrize("view", ["phantoms", "grid(g=3)"])
def test_outward_is_a_turn_of_what_is_seen_and_done(view: str) -> None:
    """The x axis points from the middle of the area to the agent: what it sees there is turned back."""
    env, outward = patrol(view, knowledge="poses")
    area = begun(f"{view[:-1]}, frame=area)" if "(" in view else f"{view}(frame=area)", env)
    observation = env.arrays.observation[:, ADVERSARIES]
    turned, plain = outward.observe(observation), area.observe(observation)
    pose = env.arrays.pose[0, :, :2]
    turn = np.exp(-1j * np.arctan2(pose[:2, 1], pose[:2, 0]))
    start = dict(zip(outward.fields, np.cumsum([0, *outward.fields.values()])))
    for name, pairs in (("pose", 2), ("detections", 16), ("poses", 10)):
        field = slice(start[name], start[name] + 2 * pairs)
        expected = plain[0, :, field].reshape(2, pairs, 2) @ [1.0, 1.0j] * turn[:, None]
        np.testing.assert_allclose(
            turned[0, :, field].reshape(2, pairs, 2) @ [1.0, 1.0j], expected, atol=1e-6
        )
    np.testing.assert_allclose(turned[0, :, start["pose"]], np.hypot(*pose[:2].T) / 850.0, atol=1e-6)
    np.testing.assert_array_equal(turned[..., start["fovs"] :], plain[..., start["fovs"] :])


def test_outward_phantoms_are_placed_away_from_the_middle_of_the_area() -> None:
    env, view = patrol("phantoms")
    play(env, view, pointing(1.0, 0.0))
    for k in ADVERSARIES:
        pose = env.arrays.pose[0, k, :2]
        np.testing.assert_allclose(injected(env, k), [pose * (1.0 + 350.0 / np.hypot(*pose))], atol=1e-2)
    np.testing.assert_allclose(
        view.observe(env.arrays.observation[:, ADVERSARIES])[0, :, -12], 0.8, atol=1e-5
    )


@pytest.mark.parametrize("view", VIEWS)
def test_more_knowledge_changes_nothing_for_who_learned_with_less(view: str) -> None:
    env, own = patrol(view)
    rich, same = patrol(str(own), knowledge="white_box", coordination="none")
    assert same.fields == own.fields
    for frame in range(5):
        seen = own.observe(env.arrays.observation[:, ADVERSARIES])
        np.testing.assert_array_equal(seen, same.observe(rich.arrays.observation[:, ADVERSARIES]))
        choices = drawn(own, 1, frame)
        np.testing.assert_array_equal(play(env, own, choices), play(rich, same, choices))


@pytest.mark.parametrize("view", VARIANTS)
def test_a_world_is_the_same_in_any_batch_and_after_a_snapshot(view: str) -> None:
    many, in_batch = patrol(view, 4)
    one, alone = patrol(view)
    one.reset(7, options={"worlds": np.array([2]), "episodes": np.array([0])})
    for frame in range(12):
        choices = drawn(in_batch, 4, frame)
        actions = play(many, in_batch, choices)
        np.testing.assert_array_equal(play(one, alone, choices[2:3])[0], actions[2])
        if frame == 6:
            state, alone = alone.get_state(), begun(view, one)
            alone.set_state(state)


def test_worlds_that_begin_an_episode_forget_and_the_others_do_not() -> None:
    env, view = patrol("phantoms", 2)
    observation = env.arrays.observation[:, ADVERSARIES]
    view.act(np.repeat(pointing(0.5, 0.5), 2, axis=0), observation)
    before = view.observe(observation)[:, 0, -12:]
    c = view.context
    mask = np.array([False, True])
    view.reset(PolicyContext(c.scenario, c.observation_table, c.agents, 1, c.worlds, c.episodes + 1, mask))
    after = view.observe(observation)[:, 0, -12:]
    np.testing.assert_array_equal(after[0], before[0])
    assert before[1].any() and not after[1].any()


# --- errors ---


@pytest.mark.parametrize(
    ("view", "message"),
    [
        ("phantom", "unknown view 'phantom'; did you mean 'phantoms'"),
        ("phantoms(m=3)", "view 'phantoms' has no parameter 'm'.*n, speed, frame, knowledge"),
        ("phantoms(n=0)", "phantoms: n = 0: expected a whole number of at least 1"),
        ("phantoms(speed=-1)", r"phantoms: speed = -1: expected a number of at least 0 \(m/s\)"),
        ("phantoms(frame=out)", "phantoms: frame = 'out': expected one of area, outward"),
        ("grid(g=1)", "grid: g = 1: expected a whole number of at least 2"),
        ("raw(knowledge=all)", "raw: knowledge = 'all': expected one of own, poses"),
        ("my_views.py:Mine", "unknown view 'my_views.py:Mine'"),
    ],
)
def test_unfit_names_and_parameters_are_refused(view: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        build_view(view)


def test_what_does_not_fit_the_scenario_is_refused() -> None:
    with pytest.raises(ValueError, match="phantoms: n = 9: expected at most 8, 2 by turns in each of 4"):
        patrol("phantoms(n=9)")
    with pytest.raises(ValueError, match="grid: knowledge = 'poses': expected at most own"):
        patrol("grid(knowledge=poses)")
    with pytest.raises(TypeError, match="a view is a name"):
        build_view(3)
    with pytest.raises(RuntimeError, match=r"call reset\(context\) first"):
        _ = build_view("raw").context
    _, view = patrol("phantoms")
    _, other = patrol("phantoms", 2)
    with pytest.raises(ValueError, match=r"place = 'complex64\[2, 2, 4\]': expected complex64\[1, 2, 4\]"):
        view.set_state(other.get_state())
