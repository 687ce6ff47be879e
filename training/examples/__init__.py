"""trust-env in other people's training libraries: a file each: `python -m trust_env.training.examples.rllib`.

Each trains for a few updates, so that it runs in seconds, then plays what it has trained and reports the
damage by the environment's own metrics. To train in earnest, raise `--updates` and the sizes of the batches.
AgileRL and BenchMARL need environments of their own: see their files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from trust_env import vector_env
from trust_env.agents import Player, Policy
from trust_env.metrics import EpisodeMetrics

Choose = Callable[[np.ndarray], Any]


@dataclass(frozen=True)
class Outcome:
    """The result of an example: the loss of every update, the change of the weights of each network
    (float[P]), and the damage per frame that the trained agents do.
    """

    library: str
    losses: Sequence[float]
    changes: Mapping[str, np.ndarray]
    damage: float

    def __str__(self) -> str:
        moved = ", ".join(f"{name} {np.linalg.norm(change):.3g}" for name, change in self.changes.items())
        losses = f"{len(self.losses)} updates, loss {self.losses[0]:.3g} -> {self.losses[-1]:.3g}"
        return f"{self.library}: {losses}; weights moved: {moved}; damage {self.damage:.2f} per frame"


class Trained(Policy):
    """A trained network as a policy: choose(observations[B, O]) -> actions[B, A]."""

    name = "trained"

    def __init__(self, choose: Choose):
        self._choose = choose

    def act(self, observations: np.ndarray) -> np.ndarray:
        worlds, agents, size = observations.shape
        return np.asarray(self._choose(observations.reshape(-1, size))).reshape(worlds, agents, -1)


def weights(network: Any) -> np.ndarray:
    """All parameters of a PyTorch module, float[P], copied."""
    return np.concatenate([parameter.detach().numpy().ravel() for parameter in network.parameters()])


def damage(policies: Mapping[str, Choose], scenario: Any, defense: Any, episodes: int = 20) -> float:
    """Mean damage per frame of trained networks, by role or agent; all other agents are honest."""
    venv = vector_env(scenario, defense, episodes, autoreset=False)
    metrics = EpisodeMetrics(venv)
    player = Player(venv, {who: Trained(choose) for who, choose in policies.items()})
    observations, _ = venv.reset(seed=1_000_000)
    for _ in range(venv.max_cycles):
        observations, *_, info = venv.step(player.actions(observations))
        metrics.update(info)
    venv.close()
    return float(metrics.result()["damage_per_frame"].mean())
