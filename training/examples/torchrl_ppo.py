"""TorchRL: the agents grouped by role; the adversaries learn by PPO, the benign agents are honest."""

from __future__ import annotations

import torch
import tyro
from tensordict.nn import NormalParamExtractor, TensorDictModule, TensorDictSequential
from torchrl.collectors import Collector
from torchrl.envs import PettingZooWrapper, check_env_specs
from torchrl.modules import MultiAgentMLP, ProbabilisticActor, TanhNormal
from torchrl.objectives import ClipPPOLoss

import trust_env
from trust_env.training.examples import Outcome, damage, weights


def entry(name: str, role: str = "adversary") -> tuple[str, str]:
    return role, name


def train(updates: int = 2, scenario: str = "trio", defense: str = "score", seed: int = 0) -> Outcome:
    """Train for a few updates and play what has been trained."""
    torch.manual_seed(seed)
    env = PettingZooWrapper(trust_env.parallel_env(scenario, defense), seed=seed)
    check_env_specs(env, seed=seed)
    agents, seen = env.observation_spec[entry("observation")].shape
    act = env.action_spec[entry("action")].shape[-1]
    shared = {"n_agents": agents, "centralized": False, "share_params": True, "depth": 2, "num_cells": 64}
    net = torch.nn.Sequential(MultiAgentMLP(seen, 2 * act, **shared), NormalParamExtractor())
    ins, outs = [entry("observation")], [entry("loc"), entry("scale")]
    drawn = {"distribution_class": TanhNormal, "return_log_prob": True, "log_prob_key": entry("log_prob")}
    actor = ProbabilisticActor(TensorDictModule(net, ins, outs), outs, [entry("action")], **drawn)
    critic = TensorDictModule(MultiAgentMLP(seen, 1, **shared), ins, [entry("value")])
    benign_ins, benign_outs = [entry("observation", "benign")], [entry("action", "benign")]
    honest = TensorDictModule(lambda seen: torch.zeros(*seen.shape[:-1], act), benign_ins, benign_outs)
    loss = ClipPPOLoss(actor, critic, normalize_advantage=True)
    loss.set_keys(**{name: entry(name) for name in ("action", "value", "reward", "done", "terminated")})
    loss.set_keys(sample_log_prob=entry("log_prob"))
    optimiser = torch.optim.Adam(loss.parameters(), lr=3e-4)
    start, losses, play = weights(net), [], TensorDictSequential(actor, honest)
    for batch in Collector(env, play, frames_per_batch=200, total_frames=200 * updates):
        for _ in range(4):
            with torch.no_grad():
                loss.value_estimator(batch)
            total = sum(value for term, value in loss(batch).items() if term.startswith("loss_"))
            optimiser.zero_grad()
            total.backward()
            optimiser.step()
        losses.append(total.item())

    def choose(observations):
        return net(torch.from_numpy(observations).reshape(-1, agents, seen))[0].tanh().detach()

    shown = damage({"adversary": choose}, scenario, defense)
    return Outcome("TorchRL", losses, {"adversary": weights(net) - start}, shown)


if __name__ == "__main__":
    print(tyro.cli(train))
