"""SuperSuit's vectors of agents, trained by Stable-Baselines3."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from clients.checks import check_trained

import trust_env

pytestmark = pytest.mark.extra("clients")


@pytest.mark.parametrize("scenario", ["trio", "patrol"])
def test_the_example_trains(scenario):
    from trust_env.training.examples import supersuit_ppo

    check_trained(supersuit_ppo.train(updates=2, scenario=scenario), 2, {"all agents"})


def test_an_example_runs_as_a_program():
    program = [
        sys.executable,
        "-m",
        "trust_env.training.examples.supersuit_ppo",
        "--updates",
        "1",
        "--seed",
        "7",
    ]
    printed = subprocess.run(program, capture_output=True, text=True, check=True).stdout
    assert printed.startswith("SuperSuit: 1 updates, loss ")


def test_a_vector_plays_what_the_environment_plays():
    import supersuit

    env = trust_env.parallel_env("trio", "trust", max_cycles=12)
    vector = supersuit.pettingzoo_env_to_vec_env_v1(trust_env.parallel_env("trio", "trust", max_cycles=12))
    observations, _ = env.reset(seed=5)
    rows, _ = vector.reset(seed=5)
    rng = np.random.default_rng(0)
    for frame in range(12):
        np.testing.assert_array_equal(rows, np.stack(list(observations.values())))
        actions = rng.uniform(-1.0, 1.0, (3, *vector.action_space.shape)).astype(np.float32)
        observations, rewards, _, truncations, _ = env.step(dict(zip(env.possible_agents, actions)))
        rows, gained, _, cut, infos = vector.step(actions)
        np.testing.assert_array_equal(gained, np.float32(list(rewards.values())))
        assert cut.all() == (frame == 11) == all(truncations.values())
    final = np.stack([info["terminal_observation"] for info in infos])
    np.testing.assert_array_equal(final, np.stack(list(observations.values())))


def test_its_vectors_cannot_be_seeded_by_stable_baselines3():
    """What the example says; where this fails, `PPO(seed=...)` has become possible."""
    import supersuit
    from stable_baselines3 import PPO

    vector = supersuit.pettingzoo_env_to_vec_env_v1(trust_env.parallel_env("trio"))
    vector = supersuit.concat_vec_envs_v1(vector, 1, base_class="stable_baselines3")
    with pytest.raises(AttributeError, match="seed"):
        PPO("MlpPolicy", vector, seed=0)
