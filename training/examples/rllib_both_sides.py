"""RLlib, both sides learning at once: the adversaries share one policy, the benign agents (which may withhold
detections that they doubt) another, each trained by PPO on its own rewards.
"""

from __future__ import annotations

import ray
import torch
import tyro
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.columns import Columns
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune.registry import register_env

import trust_env
from trust_env.training.examples import Outcome, damage, weights

SIDES = ("adversary", "benign")


def role(agent: str, *args, **kwargs) -> str:
    return agent.rsplit("_", 1)[0]


def train(updates: int = 2, scenario: str = "trio", defense: str = "score", seed: int = 0) -> Outcome:
    """Train for a few updates and play what has been trained, one side against the other."""
    ray.init(num_cpus=2, include_dashboard=False, ignore_reinit_error=True, log_to_driver=False)
    register_env("trust_env", lambda config: ParallelPettingZooEnv(trust_env.parallel_env(**config)))
    config = (
        PPOConfig()
        .environment("trust_env", env_config={"scenario": scenario, "defense": defense})
        .env_runners(num_env_runners=0)  # this process plays; with n, n others do
        .multi_agent(policies=set(SIDES), policy_mapping_fn=role)
        .training(train_batch_size_per_learner=200, minibatch_size=100, num_epochs=4)
        .debugging(seed=seed)
    )
    algo = config.build_algo()
    modules = {side: algo.get_module(side) for side in SIDES}
    start, losses = {side: weights(modules[side]) for side in SIDES}, []
    for _ in range(updates):
        learners = algo.train()["learners"]
        losses.append(sum(learners[side]["total_loss"] for side in SIDES))

    def chooser(module):
        def choose(observations):
            out = module.forward_inference({Columns.OBS: torch.from_numpy(observations)})
            return out[Columns.ACTION_DIST_INPUTS].chunk(2, dim=-1)[0].detach()  # the mean; then log std

        return choose

    shown = damage({side: chooser(modules[side]) for side in SIDES}, scenario, defense)
    changes = {side: weights(modules[side]) - start[side] for side in SIDES}
    algo.stop()
    ray.shutdown()
    return Outcome("RLlib, both sides", losses, changes, shown)


if __name__ == "__main__":
    print(tyro.cli(train))
