"""BenchMARL: independent PPO, a policy for each role; both roles learn. It needs torchrl < 0.12 and thus an
environment of its own: tests/clients/own_environments.sh makes it.
"""

from __future__ import annotations

import tempfile

import torch
import tyro
from benchmarl.algorithms import IppoConfig
from benchmarl.environments.pettingzoo.common import PettingZooClass
from benchmarl.experiment import Callback, Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig
from tensordict import TensorDict
from torchrl.envs import PettingZooWrapper

import trust_env
from trust_env.training.examples import Outcome, damage, weights


class TrustTask(PettingZooClass):
    def get_env_fun(self, num_envs, continuous_actions, seed, device):
        return lambda: PettingZooWrapper(trust_env.parallel_env(**self.config), seed=seed, device=device)

    def supports_continuous_actions(self):
        return True


class Losses(list, Callback):
    def on_train_end(self, training_td, group):
        self.append(sum(training_td[name].mean().item() for name in ("loss_objective", "loss_critic")))


def train(updates: int = 2, scenario: str = "trio", defense: str = "score", seed: int = 0) -> Outcome:
    """Train for a few updates and play what has been trained."""
    horizon, losses = trust_env.load_scenario(scenario).horizon, Losses()
    task = TrustTask("trust_env", {"scenario": scenario, "defense": defense, "max_cycles": horizon})
    config, algorithm = ExperimentConfig.get_from_yaml(), IppoConfig.get_from_yaml()
    config.max_n_iters, config.max_n_frames, config.evaluation, config.loggers = updates, None, False, []
    config.on_policy_collected_frames_per_batch, config.on_policy_n_envs_per_worker = 200, 1
    config.on_policy_n_minibatch_iters, config.on_policy_minibatch_size, config.lr = 4, 100, 3e-4
    model = MlpConfig(num_cells=[64, 64], layer_class=torch.nn.Linear, activation_class=torch.nn.Tanh)
    with tempfile.TemporaryDirectory() as config.save_folder:
        experiment = Experiment(task, algorithm, model, seed, config, callbacks=[losses])
        policies, groups = experiment.group_policies, experiment.group_map
        start = {side: weights(policy) for side, policy in policies.items()}
        experiment.run()

    def choose(side, observations):
        seen = torch.from_numpy(observations).reshape(-1, len(groups[side]), observations.shape[-1])
        return policies[side](TensorDict({(side, "observation"): seen}))[side, "action"].detach()

    shown = damage({s: lambda seen, s=s: choose(s, seen) for s in policies}, scenario, defense)
    changes = {side: weights(policy) - start[side] for side, policy in policies.items()}
    return Outcome("BenchMARL", [sum(of) for of in zip(losses[::2], losses[1::2])], changes, shown)


if __name__ == "__main__":
    print(tyro.cli(train))
