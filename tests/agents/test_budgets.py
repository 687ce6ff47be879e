"""Actions within the budgets of the agents."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from attack_runs import SCRIPTED, SHAPES, VARIANTS, injected, patrol_for, play

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


ODD: dict[str, Any] = {
    "no slots": {"injection": {"slots": 0}},
    "one detection": {"injection": {"slots": 1}, "sensor": {"max_detections": 1, "clutter_density": 1e-6}},
    "adversaries alone": {"team": {"n_adversaries": 3, "n_benign": 0}},
    "one adversary": {"team": {"n_adversaries": 1, "n_benign": 2}},
    "budgets that differ": {
        "agents": [
            {"role": "adversary", "budget": {"injections": 0}},
            {"role": "adversary", "budget": {"injections": 2, "suppressions": 1}},
            {"role": "adversary"},
            {"role": "benign"},
        ]
    },
    "narrow FOVs": {"fov": SHAPES["sector"]},
    "polygons": {"fov": SHAPES["pentagon"]},
}


@pytest.mark.parametrize("odd", ODD)
@pytest.mark.parametrize(
    "attack", [*SCRIPTED, "stealth(motion=constant_velocity, speed=200)", "fov_aware(share=False)"]
)
def test_every_attack_plays_odd_scenarios_within_its_budgets(attack: str, odd: str) -> None:
    scenario = load_scenario({"base": "patrol", "knowledge": patrol_for(attack).knowledge} | ODD[odd])
    slots, budgets = scenario.injection.slots, [scenario.agent(k).budget for k in range(scenario.n_agents)]
    for env, actions in play(scenario, attack, 12, 4):
        assert np.isfinite(actions).all() and (np.abs(actions) <= 1.0).all()
        fired = (actions[..., : 3 * slots : 3] > 0).sum(axis=-1).max(axis=0)
        withheld = (actions[..., 3 * slots :] > 0).sum(axis=-1).max(axis=0)
        assert (fired <= [b.injections for b in budgets]).all()
        assert (withheld <= [b.suppressions for b in budgets]).all()
        assert env.arrays.overflow_injections.max() == 0 or odd == "one detection"
