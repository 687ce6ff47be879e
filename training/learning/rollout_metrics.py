"""What the environment measures while the learners play."""

from __future__ import annotations

from collections.abc import Callable

from stable_baselines3.common.callbacks import BaseCallback

from trust_env.training.learning.sb3 import LearnersVecEnv


class RolloutMetrics(BaseCallback):
    """Means of the environment's own metrics over a rollout; reports progress to `advance`."""

    _NAMES = ("false_tracks", "missing_targets")

    def __init__(self, env: LearnersVecEnv):
        super().__init__()
        self._env = env
        self.advance: Callable[[int], None] = lambda n: None
        self._clear()

    def _clear(self) -> None:
        self._frames, self._sums = 0, dict.fromkeys(self._NAMES, 0.0)

    def _on_step(self) -> bool:
        self._frames += 1
        for name in self._NAMES:
            self._sums[name] += float(self._env.metrics[name].mean())
        self.advance(self._env.num_envs)
        return True

    def take(self) -> dict[str, float]:
        """Means per frame since the last call."""
        means = {f"{name}_per_frame": total / self._frames for name, total in self._sums.items()}
        self._clear()
        return {"damage_per_frame": sum(means.values())} | means
