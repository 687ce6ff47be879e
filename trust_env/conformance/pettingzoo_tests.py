"""PettingZoo's own tests, by their names, with warnings as failures.

As of version 1.27. They are imported when they run: importing `pettingzoo.test` takes half a second.
"""

from __future__ import annotations

import contextlib
import os
import warnings
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

from trust_env.conformance.pettingzoo_warnings import remark_on_warnings
from trust_env.conformance.report import Failed, Skipped, describe_error
from trust_env.conformance.rollout import action_mask
from trust_env.conformance.subject import Check, Subject

TESTED_CYCLES = 4  # in `max_cycles_test`


def parallel_api_test(subject: Subject) -> str:
    from pettingzoo.test import parallel_api_test as test

    return _run(subject, lambda: test(subject.env(), subject.cycles))


def api_test(subject: Subject) -> str:
    from pettingzoo.test import api_test as test

    return _run(subject, lambda: test(subject.aec_env(), subject.cycles))


def parallel_seed_test(subject: Subject) -> str:
    from pettingzoo.test import parallel_seed_test as test

    return _run(subject, lambda: test(subject.env, subject.cycles), ignores_masks=True)


def seed_test(subject: Subject) -> str:
    from pettingzoo.test import seed_test as test

    return _run(subject, lambda: test(subject.aec_env, subject.cycles))


def render_test(subject: Subject) -> str:
    from pettingzoo.test import render_test as test

    modes = (getattr(subject.env(), "metadata", None) or {}).get("render_modes")
    if not modes:
        raise Skipped("the environment's metadata name no render_modes")
    if not subject.accepts("render_mode"):
        raise Skipped("the factory takes no render_mode")

    def make(render_mode: str = "human") -> Any:
        # The test first makes a "human" environment, of which it only reads the metadata.
        return subject.aec_env(render_mode=render_mode if render_mode in modes else modes[0])

    with _without_display():
        return _run(subject, lambda: test(make)) or f"modes {', '.join(modes)}"


def state_test(subject: Subject) -> str:
    from pettingzoo.test import state_test as test

    env = subject.env()
    env.reset(seed=subject.seed)
    try:
        env.state()
    except (NotImplementedError, AttributeError):
        raise Skipped("the environment has no state()") from None
    if not hasattr(env, "state_space"):
        raise Failed("the environment has a state(), but no state_space")
    return _run(subject, lambda: test(subject.aec_env(), subject.env(), subject.cycles), ignores_masks=True)


def max_cycles_test(subject: Subject) -> str:
    from pettingzoo.test import max_cycles_test as test

    if not subject.accepts("max_cycles"):
        raise Skipped("the factory takes no max_cycles")
    try:
        env = subject.aec_env(max_cycles=TESTED_CYCLES)
    except TypeError as error:  # a factory may pass any option to a constructor that lacks this one
        if "max_cycles" not in str(error):
            raise
        raise Skipped("the factory takes no max_cycles") from None
    if not hasattr(env, "possible_agents"):
        raise Skipped("the environment has no possible_agents, which this test counts")
    _require_end_of_episode(env)
    module = SimpleNamespace(parallel_env=subject.env, env=subject.aec_env)
    return _run(subject, lambda: test(module), ignores_masks=True)


def _require_end_of_episode(env: Any) -> None:
    """Raise Failed where max_cycles is ignored: the test itself would then never return."""
    env.reset()
    limit = TESTED_CYCLES + 10  # as many as the test allows
    for agent in env.agent_iter(env.num_agents * (limit + 1)):
        space = env.action_space(agent)
        mask = action_mask(space, env.observe(agent), env.infos[agent])
        over = env.terminations[agent] or env.truncations[agent]
        env.step(None if over else space.sample(mask=mask))
    if env.agents:
        raise Failed(f"with max_cycles={TESTED_CYCLES} the episode has not ended after {limit} cycles")


def _run(subject: Subject, test: Callable[[], None], ignores_masks: bool = False) -> str:
    """Run a test; warnings fail it, except for recommendations and those that the caller allows."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            test()
        except Exception as error:
            if ignores_masks and subject.has_action_masks:
                reason = f"the test samples without the action masks: {describe_error(error)}"
                raise Skipped(reason) from error
            raise
    return remark_on_warnings(caught, subject.allow_warnings)


@contextlib.contextmanager
def _without_display() -> Iterator[None]:
    """Let SDL (pygame) draw into memory where no display is set."""
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or os.environ.get("SDL_VIDEODRIVER"):
        yield
        return
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    try:
        yield
    finally:
        del os.environ["SDL_VIDEODRIVER"]


CHECKS: dict[str, Check] = {
    "parallel_api_test": parallel_api_test,
    "api_test": api_test,
    "parallel_seed_test": parallel_seed_test,
    "seed_test": seed_test,
    "render_test": render_test,
    "state_test": state_test,
    "max_cycles_test": max_cycles_test,
}
