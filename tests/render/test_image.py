"""Images: what their pixels show."""

import pickle

import numpy as np
import pytest
from rendered_envs import choose_actions, pixel, rendered_env, similar

import trust_env
from trust_env.render.scene import read_scene

SHAPES = {
    "circle": {"type": "circle", "radius": 350.0},
    "sector": {"type": "sector", "radius": 350.0, "width": 1.5},
    "polygon": {
        "type": "polygon",
        "vertices": [[-50.0, -200.0], [400.0, -100.0], [400.0, 100.0], [-50.0, 200.0]],
    },
}


@pytest.mark.extra("render")
def test_equal_worlds_give_equal_images_and_another_frame_gives_another():
    first, second = rendered_env("trio", frames=5), rendered_env("trio", frames=5)
    image = first.render()
    assert image.shape == (720, 990, 3) and image.dtype == np.uint8
    assert np.array_equal(image, second.render()) and np.array_equal(image, first.render())
    second.step(choose_actions(second, True))
    assert not np.array_equal(image, second.render())
    pickled = pickle.loads(pickle.dumps(first))
    assert np.array_equal(image, pickled.render())


@pytest.mark.extra("render")
def test_image_opens_no_display(monkeypatch):
    import pygame

    def fail(*args, **kwargs):
        raise AssertionError("an image asked for a display")

    display = pygame.display
    for module, name in ((display, "init"), (display, "set_mode"), (pygame, "Window"), (pygame, "init")):
        monkeypatch.setattr(module, name, fail)
    assert rendered_env("case1", frames=1).render().shape == (720, 990, 3)


@pytest.mark.extra("render")
def test_injected_detections_are_drawn_in_the_colour_of_injections():
    from trust_env.render.palette import INJECTED

    attacked, honest = rendered_env("case1", frames=1), rendered_env("case1", frames=1, attack=False)
    positions = attacked.arrays.report_detections[attacked.arrays.report_origin <= -2]
    assert len(positions) == 2
    for position in positions:
        assert similar(pixel(attacked, attacked.render(), position), INJECTED)
        assert not similar(pixel(honest, honest.render(), position), INJECTED)


@pytest.mark.extra("render")
def test_honest_detections_are_drawn_in_their_agents_colour():
    from trust_env.render.palette import agent_colour

    env = rendered_env("case1", frames=1)
    # Target 1 is seen by agent 0 alone.
    (position,) = [p for p, n in zip(env.arrays.report_detections[0, 0], env.arrays.report_origin[0, 0]) if n == 1]
    assert similar(pixel(env, env.render(), position), agent_colour(True, 0, 2))


@pytest.mark.extra("render")
@pytest.mark.parametrize("shape", SHAPES)
def test_fovs_of_every_shape_are_tinted(shape):
    env = rendered_env({"base": "patrol", "fov": SHAPES[shape], "targets": {"slots": 0}})
    image = env.render()
    corner = image[3, 3].astype(int)  # in no FOV
    for agent in read_scene(env.worlds).agents:
        outline = agent.outline
        inside = 0.4 * outline[0] + 0.3 * outline[1] + 0.3 * outline[len(outline) // 2]
        assert not similar(pixel(env, image, inside), corner, 3)


@pytest.mark.extra("render")
def test_fovs_are_red_for_adversaries_and_blue_for_benign_agents():
    agents = [
        {"role": "adversary", "position": [-250.0, 0.0], "fov": {"radius": 200.0}},
        {"role": "benign", "position": [250.0, 0.0], "fov": {"radius": 200.0}},
    ]
    env = rendered_env({"base": "patrol", "agents": agents, "targets": {"slots": 0}})
    image = env.render()
    red, _, blue = pixel(env, image, (-290.0, 70.0))
    assert red > blue
    red, _, blue = pixel(env, image, (210.0, 70.0))
    assert blue > red


@pytest.mark.extra("render")
def test_trust_bar_is_grey_without_an_opinion():
    from trust_env.render.image import MAP_SIZE
    from trust_env.render.palette import NO_OPINION

    def greys(defense):
        panel = rendered_env("case1", frames=6, defense=defense).render()[:, MAP_SIZE:].reshape(-1, 3)
        return int((panel == NO_OPINION).all(axis=1).sum())

    assert greys("score") > 3000 and greys("trust") < 100


@pytest.mark.extra("render")
@pytest.mark.parametrize("scenario", [name for name in trust_env.scenarios() if name != "skies"])
def test_every_scenario_is_drawn_and_can_be_closed_twice(scenario):
    env = rendered_env(scenario, frames=3)
    assert np.ptp(env.render()) > 100
    env.close()
    env.close()


@pytest.mark.extra("render")
def test_sixty_four_agents_can_be_drawn():
    team = {"n_adversaries": 4, "n_benign": 60}
    assert np.ptp(rendered_env({"base": "patrol", "team": team}, frames=2).render()) > 100


@pytest.mark.extra("render")
def test_image_is_the_same_after_pygame_was_quit():
    import pygame

    env = trust_env.parallel_env("case1", render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    pygame.quit()
    assert np.array_equal(env.render(), before)
