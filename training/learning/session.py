"""The loop of a training run: rollouts, updates, evaluations and checkpoints."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from trust_env.agents.learned.policy import Learned
from trust_env.agents.wrappers import DEFAULT_WRAPPER
from trust_env.metrics import METRICS
from trust_env.scenario import Scenario
from trust_env.training.evaluation.play import measure_frames, play_frames
from trust_env.training.learning.configuration import Configuration
from trust_env.training.learning.export import export_policy
from trust_env.training.learning.learners import Learners
from trust_env.training.learning.logs import Logs, truncate
from trust_env.training.learning.ppo import build_ppo
from trust_env.training.learning.rollout_metrics import RolloutMetrics
from trust_env.training.learning.sb3 import LearnersVecEnv
from trust_env.training.learning.training_folder import TrainingFolder
from trust_env.vector import VectorEnv

Tell = Callable[[str], None]


def build_learners(config: Configuration, scenario: Scenario, num_worlds: int) -> Learners:
    """The learners of a run. ValueError: scenario, defense, wrapper and others do not fit together."""
    return Learners(
        scenario,
        config.defense,
        num_worlds,
        wrapper=config.wrapper or DEFAULT_WRAPPER,
        others=config.others,
        knowledge=config.knowledge,
        max_cycles=min(config.max_cycles or scenario.horizon, scenario.horizon),
        threads=config.threads,
        learner_role=config.role,
        stagger=True,
    )


class Session:
    """A run from `saved`, the content of its folder's last checkpoint, or from the beginning."""

    def __init__(self, folder: TrainingFolder, saved: Mapping[str, Any] | None):
        self.folder, self.config, scenario = folder, folder.configuration(), folder.scenario()
        folder.begin(self.config, scenario)
        config = self.config
        self.env = LearnersVecEnv(build_learners(config, scenario, config.worlds))
        self.scenario = self.env.learners.scenario
        self.model = build_ppo(config, self.env)
        truncate(folder.path, saved["logs"] if saved else {})
        self.logs = Logs(folder.path)
        self.model.set_logger(self.logs.training)
        self.rollout_metrics = RolloutMetrics(self.env)
        _, self._callback = self.model._setup_learn(config.steps, self.rollout_metrics)
        self._seconds_before, self._evaluated = 0.0, -1
        if saved:
            self.model.set_state(saved["model"])
            self._seconds_before, self._evaluated = saved["seconds"], saved["evaluated"]
        self._began = self._saved = time.monotonic()

    @property
    def steps(self) -> int:
        return self.model.num_timesteps

    @property
    def rollout(self) -> int:
        """Steps of all learners between two updates."""
        return self.model.n_steps * self.model.n_envs

    @property
    def total(self) -> int:
        """Steps in the end: the last rollout is a whole one."""
        return -(-self.config.steps // self.rollout) * self.rollout

    @property
    def finished(self) -> bool:
        return self.steps >= self.config.steps

    @property
    def seconds(self) -> float:
        """Of this session and those before."""
        return self._seconds_before + time.monotonic() - self._began

    def run(self, advance: Callable[[int], None], tell: Tell, stop_requested: Callable[[], bool]) -> None:
        """Train to the last step; where `stop_requested`, save everything and raise KeyboardInterrupt.

        advance(n) is called after every n steps, tell(text) after every evaluation.
        """
        self.rollout_metrics.advance = advance
        if self._evaluated < 0:
            self._evaluate(tell)
            self.save()
        while not self.finished:
            self._iterate()
            every = self.config.evaluated_every
            evaluates = self.finished or self.steps // every > self._evaluated // every
            if evaluates:
                self._evaluate(tell)
            waited = time.monotonic() - self._saved >= self.config.checkpoint.every
            if evaluates or waited or stop_requested():
                self.save()
            if stop_requested() and not self.finished:
                raise KeyboardInterrupt

    def _iterate(self) -> None:
        """A rollout, and what is learned from it."""
        model = self.model
        began, before = time.monotonic(), self.steps
        model._update_current_progress_remaining(self.steps, self.config.steps)
        model.collect_rollouts(model.env, self._callback, model.rollout_buffer, model.n_steps)  # type: ignore
        model.train()
        record = model.logger.record
        record("time/steps", self.steps, exclude="tensorboard")
        record("time/seconds", self.seconds)
        record("time/steps_per_second", (self.steps - before) / (time.monotonic() - began))
        for name, value in self.rollout_metrics.take().items():
            record(f"rollout/{name}", value)
        if model.ep_info_buffer:
            record("rollout/episode_reward", float(np.mean([e["r"] for e in model.ep_info_buffer])))
        model.logger.dump(self.steps)

    def _evaluate(self, tell: Tell) -> None:
        """Play the policy, as it is exported, on held-out worlds."""
        self._export()
        config = self.config
        policies = {config.role: Learned(str(self.folder.path)), **config.others}
        episodes, seed = config.evaluation.episodes, config.evaluation.seed
        venv = VectorEnv(self.scenario, config.defense, episodes, threads=config.threads, autoreset=False)
        infos = play_frames(venv, policies, np.arange(episodes), seed, venv.max_cycles)
        found = measure_frames(venv, infos).result()
        venv.close()
        record = self.logs.evaluation.record
        record("time/steps", self.steps, exclude="tensorboard")
        for name in METRICS:
            if not np.isnan(found[name]).all():
                record(f"evaluation/{name}", float(np.nanmean(found[name])))
        self.logs.evaluation.dump(self.steps)
        self._evaluated = self.steps
        false, missing = (found[f"{part}_per_frame"].mean() for part in ("false_tracks", "missing_targets"))
        tell(f"damage per frame {false + missing:.2f}: {false:.2f} false, {missing:.2f} missing")

    def _export(self) -> None:
        export_policy(self.folder.path, self.model, self.env.learners, self.config)

    def save(self) -> None:
        """Write the policy, and a checkpoint from which the run continues bit for bit."""
        self._export()
        self.folder.checkpoints.save(self.steps, self._state())
        self._saved = time.monotonic()

    def _state(self) -> dict[str, Any]:
        return {
            "steps": self.steps,
            "seconds": self.seconds,
            "evaluated": self._evaluated,
            "logs": self.logs.sizes(),
            "model": self.model.get_state(),
        }

    def close(self) -> None:
        self.logs.close()
        self.env.close()
