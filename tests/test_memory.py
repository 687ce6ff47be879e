"""Memory does not grow with the number of frames."""

from __future__ import annotations

import numpy as np
import pytest
from parallel_envs import zero_actions

import trust_env


def resident_bytes() -> int:
    """Memory of this process."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


def memory_growth(frames: int) -> int:
    """Bytes that this process grows by while a batch makes so many frames."""
    venv = trust_env.vector_env("patrol", "trust", num_worlds=256, max_cycles=100_000)
    venv.reset(seed=1)
    rng = np.random.default_rng(1)
    actions = rng.uniform(-1, 1, (4, *venv.arrays.action.shape))
    actions[..., :12] *= rng.random((4, *venv.arrays.action.shape[:2], 1)) < 0.1
    for step in range(40):
        venv.step(actions[step % 4])
    before = resident_bytes()
    for step in range(frames // 256):
        venv.step(actions[step % 4])
    venv.close()
    return resident_bytes() - before


def test_memory_does_not_grow_over_two_hundred_thousand_frames():
    assert memory_growth(200_000) < 4 << 20


@pytest.mark.slow
def test_memory_does_not_grow_over_a_million_frames():
    assert memory_growth(1_000_000) < 4 << 20


def test_memory_does_not_grow_over_six_thousand_dict_steps_and_three_hundred_resets():
    env = trust_env.parallel_env("trio", "trust", max_cycles=20)
    actions: dict[str, np.ndarray] = {}
    before = 0
    for step in range(6000):
        if not env.agents:
            env.reset()
            actions = actions or zero_actions(env)
        env.step(actions)
        before = before or (resident_bytes() if step == 1000 else 0)
    assert resident_bytes() - before < 4 << 20
