"""Resets of both faces: seeds, episodes and options."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from parallel_envs import snapshot

import trust_env


@pytest.mark.core
@pytest.mark.nojit
def test_episodes_are_decided_by_seed_world_and_episode():
    env = trust_env.parallel_env("trio", "trust", max_cycles=4)
    first = [{a: o.tobytes() for a, o in env.reset(seed=9)[0].items()}]
    first += [{a: o.tobytes() for a, o in env.reset()[0].items()} for _ in range(3)]
    assert len({str(obs) for obs in first}) == 4

    def begins(**kwargs: Any) -> dict[str, bytes]:
        return {a: o.tobytes() for a, o in env.reset(**kwargs)[0].items()}

    assert begins(seed=9, options={"episode": 2}) == first[2]
    assert begins() == first[3]  # the next episode after the replayed one
    assert begins(options={"world": 0, "episode": 1, "colour": "red", "options": 1}) == first[1]
    assert begins(seed=9, options={"nonsense": np.nan}) == first[0]
    other = begins(seed=9, options={"world": 5})
    assert other not in first
    assert begins(seed=9) == first[0], "a seeded reset depends on the seed alone"
    assert begins(seed=10) not in first


def test_first_resets_without_a_seed_differ():
    starts = {trust_env.parallel_env("trio").reset()[0]["benign_0"].tobytes() for _ in range(3)}
    assert len(starts) == 3


@pytest.mark.parametrize("seed", [-1, 2**63, 1.5, "1", True, np.nan])
def test_invalid_seeds_raise_and_change_nothing(seed):
    for env in (trust_env.parallel_env("case1"), trust_env.vector_env("case1")):
        env.reset(seed=3)
        before = env.worlds.rows.copy()
        with pytest.raises(ValueError, match="seed must be an integer from 0"):
            env.reset(seed=seed)
        assert np.array_equal(env.worlds.rows, before)


@pytest.mark.parametrize("seed", [0, 2**63 - 1, np.int32(5), np.uint64(7)])
def test_valid_seeds_are_used(seed):
    env = trust_env.parallel_env("case1")
    env.reset(seed=seed)
    assert env.arrays.seed[0] == seed


@pytest.mark.parametrize(
    "options", [{"world": -1}, {"episode": 2**32}, {"world": 1.0}, {"episode": "3"}, {"world": None}]
)
def test_invalid_options_raise_and_change_nothing(options):
    env = trust_env.parallel_env("case1")
    env.reset(seed=3)
    before = snapshot(env)
    with pytest.raises(ValueError, match=r"option '(world|episode)' must be an integer"):
        env.reset(seed=4, options=options)
    assert snapshot(env) == before
