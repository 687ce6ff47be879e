"""AgileRL: independent PPO, a policy for each role; both roles learn. It needs pettingzoo < 1.27 and thus an
environment of its own: tests/clients/own_environments.sh makes it.
"""

from __future__ import annotations

import torch
import tyro
from agilerl.algorithms import IPPO
from agilerl.training.train_multi_agent_on_policy import train_multi_agent_on_policy
from agilerl.vector import PzDummyVecEnv

import trust_env
from trust_env.training.examples import Outcome, damage, weights


class Recorded(IPPO):
    losses: tuple[float, ...] = ()

    def learn(self, experiences):
        by_role = super().learn(experiences)
        self.losses += (sum(by_role.values()),)
        return by_role


def train(updates: int = 2, scenario: str = "trio", defense: str = "score", seed: int = 0) -> Outcome:
    """Train for a few updates and play what has been trained."""
    torch.manual_seed(seed)
    env = PzDummyVecEnv(trust_env.parallel_env(scenario, defense))
    env.reset(seed=seed)  # AgileRL's own resets go on from here
    names, frames = env.possible_agents, 200
    seen, act = ([space(name) for name in names] for space in (env.single_observation_space, env.single_action_space))
    net = {"encoder_config": {"hidden_size": [64, 64]}}
    learner = Recorded(seen, act, names, learn_step=frames, batch_size=100, lr=3e-4, net_config=net)
    start = {role: weights(actor) for role, actor in learner.actors.items()}
    # One learner instead of a population: nothing is selected or mutated.
    train_multi_agent_on_policy(
        env, "trust_env", "IPPO", [learner], sum_scores=False,
        max_steps=frames * updates, evo_steps=frames, verbose=False,
    )  # fmt: skip
    learner.set_training_mode(False)
    roles = {name.rsplit("_", 1)[0]: name for name in names}

    def chooser(name):
        return lambda observations: learner.get_action({name: observations})[0][name]

    shown = damage({role: chooser(name) for role, name in roles.items()}, scenario, defense)
    changes = {role: weights(actor) - start[role] for role, actor in learner.actors.items()}
    return Outcome("AgileRL", learner.losses, changes, shown)


if __name__ == "__main__":
    print(tyro.cli(train))
