"""Rendering: what an image, a window and a text show of a world. No test needs a screen."""

import math
import pickle
import sys

import numpy as np
import pytest

import trust_env
from trust_env.render.scene import read_scene
from trust_env.scenario.fov import Fov
from trust_env.spaces.action import encode_action

SHAPES = {
    "circle": {"type": "circle", "radius": 350.0},
    "sector": {"type": "sector", "radius": 350.0, "width": 1.5},
    "polygon": {
        "type": "polygon",
        "vertices": [[-50.0, -200.0], [400.0, -100.0], [400.0, 100.0], [-50.0, 200.0]],
    },
}
CIRCLE = {"type": "circle", "radius": 2.0, "heading": 0.0, "width": 1.0, "vertices": None}


def started(scenario="case1", mode="rgb_array", frames=0, attack=True, defense="trust"):
    """An environment after so many frames; with `attack` the case's own, or one FP per adversary."""
    env = trust_env.parallel_env(scenario, defense, render_mode=mode)
    env.reset(seed=1)
    for _ in range(frames):
        env.step(actions(env, attack))
    return env


def actions(env, attack):
    zero = np.zeros(env.action_space(env.possible_agents[0]).shape, dtype=np.float32)
    chosen = dict.fromkeys(env.possible_agents, zero)
    for k, role in enumerate(env.scenario.roles):
        if attack and role == "adversary":
            own = [list(i.position) for i in env.scenario.injections if i.agent == k]
            places = np.array(own or [env.arrays.pose[0, k, :2] + 30.0])
            chosen[env.possible_agents[k]] = encode_action(env.scenario, env.arrays.fov_box[0, k], places)
    return chosen


def pixel(env, image, position):
    """The colour of the image at a place given in metres."""
    from trust_env.render.image import MAP
    from trust_env.render.plan import View

    x, y = View(read_scene(env).extent, (0, 0, MAP, MAP)).pixels(np.asarray(position))
    return image[int(y), int(x)].astype(int)


def close_to(colour, other, tolerance=40):
    return bool(np.abs(np.asarray(colour, dtype=int) - np.asarray(other)).max() <= tolerance)


# --- what a scene says ----------------------------------------------------------------------------------


def test_scene_before_the_first_frame_shows_the_truth_and_no_reports():
    env = started("case1")
    scene = read_scene(env)
    assert (scene.frame, scene.horizon, scene.detections, scene.tracks) == (0, 20, [], [])
    assert [t.position.tolist() for t in scene.targets] == [list(p) for p in env.scenario.targets.positions]


def test_scene_belongs_to_the_frame_just_scored():
    env = started("trio", frames=12)
    scene, a = read_scene(env), env.arrays
    alive = np.flatnonzero(a.judged_alive[0])
    assert [t.position.tolist() for t in scene.targets] == a.judged_state[0, alive, :2].tolist()
    assert not np.array_equal(a.judged_state[0, alive], a.target_state[0, alive])  # those have moved on
    assert len(scene.detections) == a.report_count.sum()
    assert sum(not t.shown and t.visible for t in scene.targets) == scene.metrics["missing_targets"]
    assert sum(t.kind == "published" for t in scene.tracks) == scene.metrics["published_tracks"]
    assert sum(t.false for t in scene.tracks) == scene.metrics["false_tracks"]


def test_scene_tells_injections_and_hidden_tracks_apart():
    env = started("case1", frames=12)
    scene = read_scene(env)
    injected = [d for d in scene.detections if d.kind == "injected"]
    assert sorted(d.agent for d in injected) == [0, 2]
    places = {i.agent: i.position for i in env.scenario.injections}
    assert all(np.allclose(d.position, places[d.agent], atol=1e-6) for d in injected)
    assert sum(t.kind == "hidden" for t in scene.tracks) == 2  # what the trust defense makes of them


def test_extent_holds_the_area_and_all_fovs_and_stays():
    env = started("patrol")
    first = read_scene(env).extent
    boxes = env.arrays.fov_box[0]
    assert first[0] < boxes[:, 0].min() and first[1] > boxes[:, 1].max()
    assert first[2] < boxes[:, 2].min() and first[3] > boxes[:, 3].max()
    env.step(actions(env, True))
    assert read_scene(env).extent == first


def test_outline_of_a_circle_lies_on_it():
    outline = Fov.model_validate(CIRCLE).shape.outline(np.array([1.0, -1.0, 0.3]))
    assert np.allclose(np.hypot(*(outline - [1.0, -1.0]).T), 2.0)


def test_outline_of_a_sector_turns_with_the_agent():
    fov = Fov.model_validate(CIRCLE | {"type": "sector", "heading": 0.5, "width": 1.0})
    outline = fov.shape.outline(np.array([1.0, 2.0, math.pi / 2]))
    angles = np.arctan2(*(outline[1:] - [1.0, 2.0]).T[::-1])
    assert outline[0].tolist() == [1.0, 2.0]  # the apex
    assert angles.min() == pytest.approx(math.pi / 2) and angles.max() == pytest.approx(math.pi / 2 + 1.0)


def test_outline_of_a_polygon_turns_with_the_agent():
    fov = Fov.model_validate(CIRCLE | {"type": "polygon", "vertices": [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]]})
    outline = fov.shape.outline(np.array([10.0, 0.0, math.pi / 2]))
    assert np.allclose(outline, [[10.0, 0.0], [10.0, 2.0], [9.0, 0.0]])  # ahead is up, left is left


# --- images ---------------------------------------------------------------------------------------------


@pytest.mark.extra("render")
def test_image_is_the_same_for_the_same_world_and_changes_with_it():
    first, second = started("trio", frames=5), started("trio", frames=5)
    image = first.render()
    assert image.shape == (720, 990, 3) and image.dtype == np.uint8
    assert np.array_equal(image, second.render()) and np.array_equal(image, first.render())
    second.step(actions(second, True))
    assert not np.array_equal(image, second.render())
    pickled = pickle.loads(pickle.dumps(first))
    assert np.array_equal(image, pickled.render())


@pytest.mark.extra("render")
def test_image_needs_no_window(monkeypatch):
    import pygame

    def refuse(*args, **kwargs):
        raise AssertionError("an image asked for a display")

    for module, name in (
        (pygame.display, "init"),
        (pygame.display, "set_mode"),
        (pygame, "Window"),
        (pygame, "init"),
    ):
        monkeypatch.setattr(module, name, refuse)
    assert started("case1", frames=1).render().shape == (720, 990, 3)


@pytest.mark.extra("render")
def test_injected_detections_have_a_colour_of_their_own():
    from trust_env.render.palette import INJECTED

    attacked, honest = started("case1", frames=1), started("case1", frames=1, attack=False)
    places = attacked.arrays.reports[attacked.arrays.report_origin <= -2]
    assert len(places) == 2
    for place in places:
        assert close_to(pixel(attacked, attacked.render(), place), INJECTED)
        assert not close_to(pixel(honest, honest.render(), place), INJECTED)


@pytest.mark.extra("render")
def test_honest_detections_have_their_agents_colour():
    from trust_env.render.palette import agent_colour

    env = started("case1", frames=1)
    (spot,) = [p for p, n in zip(env.arrays.reports[0, 0], env.arrays.report_origin[0, 0]) if n == 1]
    assert close_to(
        pixel(env, env.render(), spot), agent_colour(True, 0, 2)
    )  # target 1 is seen by agent 0 alone


@pytest.mark.extra("render")
@pytest.mark.parametrize("shape", SHAPES)
def test_fovs_are_tinted_by_role_whatever_their_shape(shape):
    env = started({"base": "patrol", "fov": SHAPES[shape], "targets": {"slots": 0}})
    image, (adversary, benign) = env.render(), ({}, {})
    for k, agent in enumerate(read_scene(env).agents):
        inside = (
            0.4 * agent.outline[0] + 0.3 * agent.outline[1] + 0.3 * agent.outline[len(agent.outline) // 2]
        )
        side = adversary if agent.adversary else benign
        side[k] = pixel(env, image, inside)
    corner = image[3, 3].astype(int)  # in no FOV
    assert all(not close_to(colour, corner, 3) for colour in (*adversary.values(), *benign.values()))


@pytest.mark.extra("render")
def test_lone_fovs_are_red_and_blue():
    agents = [
        {"role": "adversary", "position": [-250.0, 0.0], "fov": {"radius": 200.0}},
        {"role": "benign", "position": [250.0, 0.0], "fov": {"radius": 200.0}},
    ]
    env = started({"base": "patrol", "agents": agents, "targets": {"slots": 0}})
    image = env.render()
    red, _, blue = pixel(env, image, (-290.0, 70.0))
    assert red > blue
    red, _, blue = pixel(env, image, (210.0, 70.0))
    assert blue > red


@pytest.mark.extra("render")
def test_trust_bar_is_grey_without_an_opinion():
    from trust_env.render.image import MAP
    from trust_env.render.palette import NO_OPINION

    def greys(defense):
        panel = started("case1", frames=6, defense=defense).render()[:, MAP:].reshape(-1, 3)
        return int((panel == NO_OPINION).all(axis=1).sum())

    assert greys("score") > 3000 and greys("trust") < 100


@pytest.mark.extra("render")
@pytest.mark.parametrize("scenario", [name for name in trust_env.scenarios() if name != "skies"])
def test_every_scenario_can_be_drawn(scenario):
    env = started(scenario, frames=3)
    assert np.ptp(env.render()) > 100
    env.close()
    env.close()


@pytest.mark.extra("render")
def test_sixty_four_agents_fit():
    team = {"n_adversaries": 4, "n_benign": 60}
    assert np.ptp(started({"base": "patrol", "team": team}, frames=2).render()) > 100


# --- windows --------------------------------------------------------------------------------------------


@pytest.mark.extra("render")
def test_window_closed_by_the_user_lets_the_environment_go_on():
    import pygame

    env, other = started("case1", mode="human"), started("case2", mode="human")
    assert env.render() is None and other.render() is None
    pygame.event.post(pygame.event.Event(pygame.WINDOWCLOSE, window=env._renderer._window))
    other.render()
    assert other._renderer._window is not None  # it was not the one that was closed
    env.render()
    assert env._renderer._window is None
    env.step(actions(env, False))  # draws by itself, to nobody
    for each in (env, other):
        each.close()
        each.close()


@pytest.mark.extra("render")
def test_missing_display_is_said_plainly(monkeypatch):
    import pygame

    def fail():
        raise pygame.error("No available video device")

    monkeypatch.setattr(pygame.display, "init", fail)
    with pytest.raises(RuntimeError, match="rgb_array"):
        started("case1", mode="human").render()


@pytest.mark.parametrize("mode", ["rgb_array", "human"])
def test_missing_pygame_names_the_extra(monkeypatch, mode):
    monkeypatch.setitem(sys.modules, "pygame", None)
    env = started("case1", mode=mode)
    with pytest.raises(ImportError, match=r"trust-env\[render\]"):
        env.render()


@pytest.mark.extra("render")
def test_passes_the_render_test_of_pettingzoo():
    from pettingzoo.test import render_test

    render_test(lambda render_mode: trust_env.env("trio", render_mode=render_mode))


# --- text -----------------------------------------------------------------------------------------------


def test_text_shows_the_map_and_the_numbers():
    env = started("case1", mode="ansi", frames=12)
    text = env.render()
    assert isinstance(text, str) and "case1, defense trust: frame 12 of 20 (1.2 s)" in text
    assert "picture 4, false 0 (injected 0), missing 0 of 4" in text
    drawn = "".join(line for line in text.splitlines() if line.startswith("|"))
    assert {sign: drawn.count(sign) for sign in "ABox"} == {"A": 2, "B": 1, "o": 4, "x": 2}
    (row,) = [line.split() for line in text.splitlines() if line.startswith("benign_0")]
    assert row[1] == f"{env.arrays.agent_trust[0, 1]:.2f}" and row[-2:] == ["2", "0"]
    assert text.count("hidden") == 3 and text.count("shown") == 4  # two tracks and the legend; four tracks


def test_text_says_when_there_is_no_opinion_and_needs_no_pygame(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    assert started("case1", mode="ansi", frames=2, defense="score").render().count("no opinion") == 3


def test_draws_again_after_somebody_has_quit_pygame():
    env = trust_env.parallel_env("case1", render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    pytest.importorskip("pygame").quit()
    assert np.array_equal(env.render(), before)
