"""TorchRL's PettingZoo wrapper."""

from __future__ import annotations

import numpy as np
import pytest
from clients.checks import check_trained

import trust_env

pytestmark = [
    pytest.mark.extra("clients"),
    pytest.mark.filterwarnings("ignore:PettingZoo in TorchRL is tested using version"),
]


@pytest.mark.parametrize("scenario", ["trio", "patrol"])
def test_the_example_trains(scenario):
    from trust_env.training.examples import torchrl_ppo

    check_trained(torchrl_ppo.train(updates=2, scenario=scenario), 2, {"adversary"})


def test_the_same_seed_gives_the_same_weights():
    from trust_env.training.examples import torchrl_ppo

    first, second = (torchrl_ppo.train(updates=1, seed=3).changes["adversary"] for _ in range(2))
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("scenario", ["case1", "trio", "patrol(knowledge=white_box)"])
def test_specs_hold_in_both_forms(scenario):
    from torchrl.envs import PettingZooWrapper, check_env_specs

    check_env_specs(PettingZooWrapper(trust_env.parallel_env(scenario), return_state=True), seed=0)
    check_env_specs(PettingZooWrapper(trust_env.env(scenario), use_mask=True), seed=0)


def test_agents_are_grouped_by_role():
    from torchrl.envs import PettingZooWrapper

    groups = PettingZooWrapper(trust_env.parallel_env("patrol")).group_map
    assert groups == {
        "adversary": ["adversary_0", "adversary_1"],
        "benign": ["benign_0", "benign_1", "benign_2"],
    }


def test_a_rollout_is_what_the_environment_plays():
    import torch
    from torchrl.envs import PettingZooWrapper

    torch.manual_seed(0)
    env = trust_env.parallel_env("trio", "trust", max_cycles=12)
    rollout = PettingZooWrapper(trust_env.parallel_env("trio", "trust", max_cycles=12), seed=4).rollout(50)
    assert rollout.shape == (12,)  # until the horizon
    assert rollout["next", "truncated"].squeeze().tolist() == 11 * [False] + [True]
    assert not rollout["next", "terminated"].any()
    env.reset(seed=4)  # the wrapper has done so when it was made
    env.reset()
    for frame in rollout:
        played = [*frame["adversary", "action"], *frame["benign", "action"]]
        actions = {agent: action.numpy() for agent, action in zip(env.agents, played, strict=True)}
        observations, rewards, _, _, infos = env.step(actions)
        after = frame["next", "adversary"]
        np.testing.assert_array_equal(after["observation"][0].numpy(), observations["adversary_0"])
        assert after["reward"].item() == np.float32(rewards["adversary_0"])
        assert after["info", "injected_tracks"].item() == infos["adversary_0"]["injected_tracks"]
