"""Tianshou: the agents in turn (AEC); both roles learn, each role one SAC."""

from __future__ import annotations

import torch
import tyro
from tianshou.algorithm import SAC, MultiAgentOffPolicyAlgorithm
from tianshou.algorithm.modelfree.sac import SACPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Batch, Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv, PettingZooEnv
from tianshou.utils.net.common import Net
from tianshou.utils.net.continuous import ContinuousActorProbabilistic, ContinuousCritic
from tianshou.utils.torch_utils import policy_within_training_step

import trust_env
from trust_env.training.examples import Outcome, damage, weights


class Learner(SAC):
    def __init__(self, env):
        seen, act, adam = env.observation_space, env.action_space, AdamOptimizerFactory(3e-4)
        sizes = {"state_shape": seen.shape, "hidden_sizes": (64, 64)}
        body, both = Net(**sizes), Net(**sizes, action_shape=act.shape, concat=True)
        heads = {"action_shape": act.shape, "unbounded": True, "conditioned_sigma": True}
        actor = ContinuousActorProbabilistic(preprocess_net=body, **heads)
        policy = SACPolicy(actor=actor, action_space=act, observation_space=seen)
        nets = {"policy": policy, "critic": ContinuousCritic(preprocess_net=both)}
        # A frame's rewards come with the last agent's turn: returns go on to an agent's own next turn.
        super().__init__(**nets, policy_optim=adam, critic_optim=adam, n_step_return_horizon=len(env.agents))

    def _target_q(self, buffer, indices):  # the observation alone: beside it stands the agent's name
        seen = Batch(obs=buffer[indices].obs_next.obs, info=[None] * len(indices))
        return self._target_q_compute_value(seen, self._target_q_compute_action(seen))


def train(updates: int = 2, scenario: str = "trio", defense: str = "score", seed: int = 0) -> Outcome:
    """Train for a few updates and play what has been trained."""
    torch.manual_seed(seed)
    env = PettingZooEnv(trust_env.env(scenario, defense))
    sides = {"adversary": Learner(env), "benign": Learner(env)}
    algorithm = MultiAgentOffPolicyAlgorithm(algorithms=[sides[a.split("_")[0]] for a in env.agents], env=env)
    # Tianshou 2.0.1 asks for `obs_next`, which its collector does not have.
    algorithm.policy.register_forward_pre_hook(lambda _, args: setattr(args[0], "obs_next", Batch()))
    collector = Collector(algorithm, DummyVectorEnv([lambda: env]), VectorReplayBuffer(20_000, 1))
    collector.reset(gym_reset_kwargs={"seed": seed})
    actors = {side: sides[side].policy.actor for side in sides}
    start, losses = {side: weights(actors[side]) for side in sides}, []
    for _ in range(updates):
        with policy_within_training_step(algorithm.policy):
            torch.no_grad()(collector.collect)(n_step=300)
            found = algorithm.update(collector.buffer, sample_size=256).get_loss_stats_dict()
        losses.append(sum(found[name] for name in found if "critic" in name))
    means = {side: lambda seen, net=actors[side]: net(seen)[0][0].tanh().detach() for side in sides}
    shown = damage(means, scenario, defense)
    return Outcome("Tianshou", losses, {s: weights(actors[s]) - start[s] for s in sides}, shown)


if __name__ == "__main__":
    print(tyro.cli(train))
