"""`particle`: the posterior it stands for, and draws that depend on nothing but the world."""

from __future__ import annotations

import numpy as np
import pytest

import trust_env

FRAME = {"track_id": [3], "expected": np.ones((3, 1), dtype=bool)}
HIT = np.array([[True], [True], [False]])


@pytest.mark.core
def test_without_motion_the_mean_is_that_of_a_beta_posterior():
    frames = [{**FRAME, "detected": HIT, "held": HIT}] * 8
    last = trust_env.replay_evidence(frames, 3, "particle(n=10000, sigma=0)")[-1]
    # agent 2 disagreed 8 times; of the others' first votes the two halves were even
    assert last.agent_trust == pytest.approx([9 / 10 - 1 / 90, 9 / 10 - 1 / 90, 1 / 10], abs=0.02)
    assert last.agent_trust_var[2] == pytest.approx(9 / (100 * 11), abs=0.003)


def drifted(worlds: int, frames: int, n: int = 199) -> list[np.ndarray]:
    """Particles [W, K, n] of worlds without tracks, by frame."""
    env = trust_env.vector_env("trio(targets.initial=0, targets.birth_rate=0)", f"particle(n={n})", num_worlds=worlds)
    env.reset(seed=6)
    found = [env.arrays.particle_r.copy()]
    for _ in range(frames):
        env.step(np.zeros(env.arrays.action.shape))
        found.append(env.arrays.particle_r.copy())
    return found


def test_particles_move_by_sigma_and_stay_in_range():
    before, after, *_, last = drifted(40, 60)
    inner = (before > 0.1) & (before < 0.9)
    moves = (after - before)[inner]
    assert moves.std() == pytest.approx(0.02, rel=0.02) and abs(moves.mean()) < 0.0005
    assert (last > 0).all() and (last < 1).all() and len(np.unique(after)) == after.size


def test_draws_do_not_depend_on_the_batch():
    few, many = drifted(2, 5), drifted(5, 5)
    assert all(np.array_equal(a, b[:2]) for a, b in zip(few, many))


def test_unlikely_particles_are_replaced():
    env = trust_env.vector_env("patrol", "particle", num_worlds=4)
    env.reset(seed=1)
    for _ in range(40):
        env.step(np.zeros(env.arrays.action.shape))
    weights, r = env.arrays.particle_w, env.arrays.particle_r
    assert weights.sum(axis=-1) == pytest.approx(1.0)
    assert (1 / (weights**2).sum(axis=-1) >= 0.5 * weights.shape[-1]).all()
    assert env.arrays.agent_trust == pytest.approx((weights * r).sum(axis=-1), abs=0.02)
    assert r.std(axis=-1).max() < 0.15 < env.arrays.agent_trust.min()
