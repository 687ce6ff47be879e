"""Actions within the budgets of the agents."""

from __future__ import annotations

import numpy as np
import pytest
from attack_runs import VARIANTS, injected, patrol_for, play

from trust_env.agents import Player
from trust_env.scenario import load_scenario
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core


@pytest.mark.parametrize("attack", VARIANTS)
def test_actions_stay_within_budgets(attack: str) -> None:
    budget = {"injections": 1, "suppressions": 2}
    agents = [{"role": "adversary", "budget": budget}, {"role": "adversary"}, {"role": "benign"}]
    scenario = load_scenario({"base": "patrol", "knowledge": patrol_for(attack).knowledge, "agents": agents})
    for env, actions in play(scenario, attack, 5, 8):
        slots, entries = actions[..., :12].reshape(8, 3, 4, 3), actions[..., 12:]
        assert (slots[:, 0, 1:, 0] <= 0).all() and (entries[:, 0, 2:] <= 0).all()
        assert (~np.isnan(injected(env)[:, 0, :, 0])).sum(axis=1).max() <= 1
        assert (actions[:, 2] == 0).all()


def test_benign_agents_cannot_be_made_to_inject() -> None:
    env = VectorEnv("trio", "score", 4)
    player = Player(env, {"benign": "random"})
    seen, _ = env.reset(1)
    for _ in range(5):
        actions = player.actions(seen)
        assert (actions[:, 1:, :6] == 0).all() and (actions[:, 0] == 0).all()
        assert (actions[:, 1:, 6:] > 0).any() and (actions[:, 1:, 6:] < 0).any()
        seen, *_ = env.step(actions)
