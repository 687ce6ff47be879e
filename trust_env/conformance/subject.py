"""The environment under test: how fresh ones are made, its reference episode, and the results so far."""

from __future__ import annotations

import contextlib
import copy
import inspect
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from pettingzoo.utils import parallel_to_aec

from trust_env.conformance.report import Failed, Result, Skipped
from trust_env.conformance.rollout import Env, Frame, PolicyFactory, advance, begin, play

# The reference episode stops there: image observations would fill the memory otherwise.
MAX_RECORDED_BYTES = 256 * 2**20


@dataclass
class Subject:
    """Makes environments for the checks, records the reference episode, and keeps the results so far."""

    make_env: Callable[..., Env] | Env
    aec: Callable[..., Any] | None
    seed: int
    num_cycles: int
    max_seconds: float
    make_policy: PolicyFactory
    allow_warnings: tuple[str, ...]
    results: dict[str, Result] = field(default_factory=dict)
    _open: list[Any] = field(default_factory=list)

    def env(self, **options: Any) -> Env:
        """A fresh environment, its action spaces seeded so that samples of them are repeatable."""
        make: Any = self.make_env
        return self._prepare(make(**options) if self.is_factory else copy.deepcopy(make))

    def aec_env(self, **options: Any) -> Any:
        """A fresh environment in its AEC form."""
        return self._prepare(self.aec(**options)) if self.aec else parallel_to_aec(self.env(**options))

    @property
    def is_factory(self) -> bool:
        """Whether `make_env` makes environments; otherwise it is one, and copied."""
        return isinstance(self.make_env, type) or not hasattr(self.make_env, "reset")

    def accepts(self, option: str) -> bool:
        """Whether the factories take a keyword argument."""
        factories = [self.make_env, self.aec] if self.aec else [self.make_env]
        return self.is_factory and all(_accepts(factory, option) for factory in factories)

    @cached_property
    def name(self) -> str:
        """What the environment calls itself, or the factory's name."""
        try:
            return str(self.env())
        except Exception:
            return getattr(self.make_env, "__name__", type(self.make_env).__name__)
        finally:
            self.close_environments()

    @cached_property
    def reference(self) -> list[Frame]:
        """A seeded episode of a fresh environment; its actions are repeated by the checks."""
        return self._recorded[0]

    @property
    def has_action_masks(self) -> bool:
        """Whether an observation or an info of the first frame has a mask, as PettingZoo documents it."""
        first = self.reference[0]
        entries = [*first.observations.values(), *first.infos.values()]
        return any(isinstance(entry, dict) and "action_mask" in entry for entry in entries)

    @property
    def seconds_per_step(self) -> float:
        return self._recorded[1] / max(1, len(self.reference) - 1)

    @property
    def cycles(self) -> int:
        """How many cycles PettingZoo's tests may run within `max_seconds`; ten at least."""
        affordable = self.max_seconds / max(self.seconds_per_step, 1e-9)
        return int(np.clip(affordable, min(10, self.num_cycles), self.num_cycles))

    @property
    def episode_remark(self) -> str:
        """How many steps the reference episode has, and whether it was cut short."""
        steps = len(self.reference) - 1
        unfinished = bool(self.reference[-1].agents)
        return f"the first {steps} steps; the episode had not ended" if unfinished else f"{steps} steps"

    def passed(self, check: str) -> bool:
        return check in self.results and self.results[check].status == "passed"

    def failed(self, check: str) -> bool:
        return check in self.results and self.results[check].status == "failed"

    def fail_if_deterministic(self, difference: str) -> None:
        """Raise Failed because two runs differ, or Skipped where any two runs of the environment do."""
        if self.failed("whole_episode_determinism"):
            raise Skipped(f"cannot be judged while whole_episode_determinism fails ({difference})")
        raise Failed(difference)

    def close_environments(self) -> None:
        """Close what `env` and `aec_env` made; errors are ignored, as closing has a check of its own."""
        while self._open:
            with contextlib.suppress(Exception):
                self._open.pop().close()

    def _prepare(self, env: Any) -> Any:
        self._open.append(env)
        for index, agent in enumerate(getattr(env, "possible_agents", ())):
            env.action_space(agent).seed(self.seed + index)
        return env

    @cached_property
    def _recorded(self) -> tuple[list[Frame], float]:
        """The reference episode, and how many seconds its steps took."""
        self._warm_up()
        env = self.env()
        frames, recorded, started = [begin(env, self.seed)], 0, time.perf_counter()
        for frame in advance(env, frames[0], self.make_policy(env, self.seed), self.num_cycles):
            frames.append(frame)
            recorded += _bytes(frame.observations)
            if time.perf_counter() - started > self.max_seconds or recorded > MAX_RECORDED_BYTES:
                break
        return frames, time.perf_counter() - started

    def _warm_up(self) -> None:
        """One step, which may have to compile."""
        env = self.env()
        play(env, self.make_policy(env, self.seed), 1, self.seed)


# Returns a remark or None where the environment passes; raises Failed or Skipped otherwise.
Check = Callable[[Subject], str | None]


def _accepts(factory: Any, option: str) -> bool:
    parameters = inspect.signature(factory).parameters
    return option in parameters or any(p.kind is p.VAR_KEYWORD for p in parameters.values())


def _bytes(value: Any) -> int:
    if isinstance(value, dict):
        return sum(map(_bytes, value.values()))
    return value.nbytes if isinstance(value, np.ndarray) else 0
