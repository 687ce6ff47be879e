"""SuperSuit: the agents of one world as the environments of a vector, for Stable-Baselines3's PPO.

All agents share one policy, the adversaries and the benign ones; which an agent is stands in its observation.
"""

from __future__ import annotations

import supersuit
import tyro
from stable_baselines3 import PPO
from stable_baselines3.common.utils import set_random_seed

import trust_env
from trust_env.training.examples import Outcome, damage, weights


def train(updates: int = 2, scenario: str = "trio", defense: str = "score", seed: int = 0) -> Outcome:
    """Train for a few updates and play what has been trained."""
    set_random_seed(seed)
    vector = supersuit.pettingzoo_env_to_vec_env_v1(trust_env.parallel_env(scenario, defense))
    vector = supersuit.concat_vec_envs_v1(vector, 2, base_class="stable_baselines3")
    # No PPO(seed=...): it asks the vector for seed(), which SuperSuit's lack (AttributeError). Networks and
    # exploration are seeded above, the worlds draw fresh entropy. Nor does SuperSuit tell SB3 that the
    # horizon cuts episodes off, so that no values are bootstrapped there.
    batch = 64 * vector.num_envs
    model = PPO("MlpPolicy", vector, n_steps=64, batch_size=batch, n_epochs=4)
    start, losses = weights(model.policy), []
    for update in range(updates):
        model.learn(batch, reset_num_timesteps=update == 0)
        losses.append(model.logger.name_to_value["train/loss"])
    vector.close()

    def choose(observations):
        return model.predict(observations, deterministic=True)[0]

    shown = damage({"adversary": choose, "benign": choose}, scenario, defense)
    return Outcome("SuperSuit", losses, {"all agents": weights(model.policy) - start}, shown)


if __name__ == "__main__":
    print(tyro.cli(train))
