"""Windows, without a screen."""

import pytest
from rendered_envs import choose_actions, rendered_env


@pytest.mark.extra("render")
def test_environment_goes_on_after_the_user_closed_its_window():
    import pygame

    env, other = rendered_env("case1", mode="human"), rendered_env("case2", mode="human")
    assert env.render() is None and other.render() is None
    pygame.event.post(pygame.event.Event(pygame.WINDOWCLOSE, window=env._renderer._window))
    other.render()
    assert other._renderer._window is not None  # it was not the one that was closed
    env.render()
    assert env._renderer._window is None
    env.step(choose_actions(env, False))  # draws by itself, to nobody
    for each in (env, other):
        each.close()
        each.close()


@pytest.mark.extra("render")
def test_without_a_display_the_error_names_modes_that_need_none(monkeypatch):
    import pygame

    def fail():
        raise pygame.error("No available video device")

    monkeypatch.setattr(pygame.display, "init", fail)
    with pytest.raises(RuntimeError, match="rgb_array"):
        rendered_env("case1", mode="human").render()
