"""Every render mode, and what it needs."""

import sys

import pytest
from rendered_envs import rendered_env

import trust_env


@pytest.mark.parametrize("mode", ["rgb_array", "human"])
def test_without_pygame_the_error_names_the_extra(monkeypatch, mode):
    monkeypatch.setitem(sys.modules, "pygame", None)
    env = rendered_env("case1", mode=mode)
    with pytest.raises(ImportError, match=r"trust-env\[render\]"):
        env.render()


@pytest.mark.extra("render")
def test_pettingzoos_render_test_passes():
    from pettingzoo.test import render_test

    render_test(lambda render_mode: trust_env.env("trio", render_mode=render_mode))
