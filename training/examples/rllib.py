"""RLlib, new API stack: a module per role; the adversaries learn by PPO, the benign agents are honest."""

from __future__ import annotations

import ray
import torch
import tyro
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.columns import Columns
from ray.rllib.core.rl_module import MultiRLModuleSpec, RLModule, RLModuleSpec
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune.registry import register_env

import trust_env
from trust_env.training.examples import Outcome, damage, weights


class Honest(RLModule):  # the zero action: reports what it sees
    def _forward(self, batch, **kwargs):
        return {Columns.ACTIONS: torch.zeros(len(batch[Columns.OBS]), *self.action_space.shape)}


def role(agent: str, *args, **kwargs) -> str:
    return agent.rsplit("_", 1)[0]


def train(updates: int = 2, scenario: str = "trio", defense: str = "score", seed: int = 0) -> Outcome:
    """Train for a few updates and play what has been trained."""
    ray.init(num_cpus=2, include_dashboard=False, ignore_reinit_error=True, log_to_driver=False)
    register_env("trust_env", lambda config: ParallelPettingZooEnv(trust_env.parallel_env(**config)))
    modules = {"adversary": RLModuleSpec(), "benign": RLModuleSpec(module_class=Honest)}
    config = (
        PPOConfig()
        .environment("trust_env", env_config={"scenario": scenario, "defense": defense})
        .env_runners(num_env_runners=0)  # this process plays; with n, n others do
        .multi_agent(policies=set(modules), policy_mapping_fn=role, policies_to_train=["adversary"])
        .rl_module(rl_module_spec=MultiRLModuleSpec(rl_module_specs=modules))
        .training(train_batch_size_per_learner=200, minibatch_size=100, num_epochs=4)
        .debugging(seed=seed)
    )
    algo = config.build_algo()
    adversary = algo.get_module("adversary")
    start = weights(adversary)
    losses = [algo.train()["learners"]["adversary"]["total_loss"] for _ in range(updates)]

    def choose(observations):
        out = adversary.forward_inference({Columns.OBS: torch.from_numpy(observations)})
        return out[Columns.ACTION_DIST_INPUTS].chunk(2, dim=-1)[0].detach()  # the mean; then log std

    shown = damage({"adversary": choose}, scenario, defense)
    algo.stop()
    ray.shutdown()
    return Outcome("RLlib", losses, {"adversary": weights(adversary) - start}, shown)


if __name__ == "__main__":
    print(tyro.cli(train))
