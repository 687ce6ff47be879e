"""Numbers that do not depend on the version of Numba; numba_versions.sh compares the oldest and newest."""

from __future__ import annotations

import numpy as np
import pytest

import trust_env
from trust_env.metrics import gospa
from trust_env.world.random import DETECTION, uniforms

WORLDS, FRAMES, SEED = 32, 40, 7
INJECT = 1.0, 0.2, -0.3  # adversary_0 reports one false target, always at the same place of its field of view
TRUST = [
    [0.7260332586112533, 0.7174538538551570, 0.7342029317931695],
    [0.6211599863501092, 0.8062445216094775, 0.7562603298047847],
]
GOSPA = [4.347461023597239, 9.110957466605225]  # m
UNIFORMS = [
    [0.9757404378385864, 0.8890113779001392, 0.9265904544075773],
    [0.2942479506683445, 0.08885940445928775, 0.2948425886690669],
]


def exactly(expected):
    return pytest.approx(np.array(expected), rel=0.0, abs=1e-9)


@pytest.mark.parametrize("threads", [1, 2])
def test_trust_and_gospa_of_an_attacked_trio_do_not_depend_on_the_numba_version(threads):
    env = trust_env.vector_env(scenario="trio", defense="trust", num_worlds=WORLDS, threads=threads)
    env.reset(seed=SEED)
    actions = np.zeros((WORLDS, 3, env.single_action_space.shape[0]))
    actions[:, 0, :3] = INJECT
    for _ in range(FRAMES):
        info = env.step(actions)[-1]
    assert info["agent_trust"][:2] == exactly(TRUST)
    assert info["gospa"][:2] == exactly(GOSPA)


def test_uniform_draws_do_not_depend_on_the_numba_version():
    draws = uniforms(SEED, worlds=[0, 1], episodes=[0, 2], stream=DETECTION, frames=[4, 5], count=3)
    assert draws == exactly(UNIFORMS)


def test_gospa_of_one_pair_and_one_false_estimate():
    distance = gospa([[0.0, 0.0], [10.0, 0.0]], [[0.0, 3.0]], cutoff=20.0)
    assert distance == exactly([np.sqrt(209.0), 9.0, 0.0, 200.0])  # 3², and half of 20² for the false one
