"""trust-env in other people's training libraries: a file each: `python -m trust_env.training.examples.rllib`.

Each trains for a few updates, so that it runs in seconds, then plays what it has trained and reports the
damage by the environment's own metrics. To train in earnest, raise `--updates` and the sizes of the batches.
AgileRL and BenchMARL need environments of their own: see their files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from trust_env import vector_env
from trust_env.agents import Player, Policy
from trust_env.metrics import EpisodeMetrics

Choose = Callable[[np.ndarray], Any]


class Damage(NamedTuple):
    """Means per frame: false tracks shown, and targets missing from the picture."""

    false: float
    missing: float

    def __str__(self) -> str:
        return f"damage {self.false + self.missing:.2f} per frame ({self.false:.2f} false, {self.missing:.2f} missing)"


@dataclass(frozen=True)
class Outcome:
    """The result of an example: the loss of every update, the change of the weights of each network
    (float[P]), and the damage that the trained agents do.
    """

    library: str
    losses: Sequence[float]
    changes: Mapping[str, np.ndarray]
    damage: Damage

    def __str__(self) -> str:
        moved = ", ".join(f"{name} {np.linalg.norm(change):.3g}" for name, change in self.changes.items())
        losses = f"{len(self.losses)} updates, loss {self.losses[0]:.3g} -> {self.losses[-1]:.3g}"
        return f"{self.library}: {losses}; weights moved: {moved}; {self.damage}"


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


def damage(policies: Mapping[str, Choose], scenario: Any, defense: Any, episodes: int = 20) -> Damage:
    """The damage of trained networks, by role or agent; all other agents are honest."""
    venv = vector_env(scenario, defense, episodes, autoreset=False)
    metrics = EpisodeMetrics(venv)
    player = Player(venv, {who: Trained(choose) for who, choose in policies.items()})
    observations, _ = venv.reset(seed=1_000_000)
    for _ in range(venv.max_cycles):
        observations, *_, info = venv.step(player.actions(observations))
        metrics.update(info)
    venv.close()
    found = metrics.result()
    return Damage(*(float(found[f"{part}_per_frame"].mean()) for part in ("false_tracks", "missing_targets")))
