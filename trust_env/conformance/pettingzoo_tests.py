"""PettingZoo's own tests, by their names, with warnings as failures.

Read with version 1.27. They are imported when they run: `pettingzoo.test` takes half a second.
"""

from __future__ import annotations

import contextlib
import os
import re
import textwrap
import warnings
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

from trust_env.conformance.report import Check, Failed, Skipped, described
from trust_env.conformance.rollout import action_mask
from trust_env.conformance.subject import Subject

# What PettingZoo recommends to every environment and excuses, by name, in its own. An environment of another
# name cannot comply without becoming another environment, so these are remarks here. All else is a failure.
RECOMMENDATIONS = {
    r"space for each \w+ probably should be": "others than Box and Discrete are part of the API",
    r"^Observation is not a NumPy array": "nor are those of a Discrete space or a Dict with an action mask",
    r"^Agents have different|^Observations (are|have) different|^The class of": "agents may differ",
    r"^Observation numpy array is all zeros": "an empty board is a valid observation",
    r"is a single number": "so is a single number",
    r"in the shape of a graphical observation": "a guess: not every matrix is an image",
    r"^State is a single number|^State numpy array is all zeros": "as for observations",
    r"does not have possible_agents defined": "optional, for environments that make up agents as they go",
    r"does not have a `render_mode` defined|has not defined a render\(\)": "rendering is optional",
}

TESTED_CYCLES = 4  # in `max_cycles_test`

# Deprecations and the like are between libraries; PettingZoo and NumPy warn with these two.
_FAILING = (UserWarning, RuntimeWarning)


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
        # The test begins with a "human" environment, of which it only reads the metadata.
        return subject.aec_env(render_mode=render_mode if render_mode in modes else modes[0])

    with _without_a_screen():
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
    except TypeError as error:  # a factory that hands all it gets on to a constructor without it
        if "max_cycles" not in str(error):
            raise
        raise Skipped("the factory takes no max_cycles") from None
    if not hasattr(env, "possible_agents"):
        raise Skipped("the environment has no possible_agents, which this test counts")
    _refuse_the_endless(env)
    module = SimpleNamespace(parallel_env=subject.env, env=subject.aec_env)
    return _run(subject, lambda: test(module), ignores_masks=True)


def _refuse_the_endless(env: Any) -> None:
    """The test itself would wait for ever for an environment that does not stop at its max_cycles."""
    env.reset()
    limit = TESTED_CYCLES + 10  # as many as the test grants
    for agent in env.agent_iter(env.num_agents * (limit + 1)):
        space = env.action_space(agent)
        mask = action_mask(space, env.observe(agent), env.infos[agent])
        over = env.terminations[agent] or env.truncations[agent]
        env.step(None if over else space.sample(mask=mask))
    if env.agents:
        raise Failed(f"with max_cycles={TESTED_CYCLES} the episode has not ended after {limit} cycles")


CHECKS: dict[str, Check] = {
    "parallel_api_test": parallel_api_test,
    "api_test": api_test,
    "parallel_seed_test": parallel_seed_test,
    "seed_test": seed_test,
    "render_test": render_test,
    "state_test": state_test,
    "max_cycles_test": max_cycles_test,
}


def _run(subject: Subject, test: Callable[[], None], ignores_masks: bool = False) -> str:
    """Run a test; its warnings fail it, but for recommendations and those that the caller allows."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            test()
        except Exception as error:
            if ignores_masks and subject.has_action_masks:
                raise Skipped(f"the test samples without the action masks: {described(error)}") from error
            raise
    texts = dict.fromkeys(_first_words(str(w.message)) for w in caught if issubclass(w.category, _FAILING))
    remarks = {text: reason for text in texts if (reason := _excuse(text, subject.allow_warnings))}
    faults = [text for text in texts if text not in remarks]
    if faults:
        raise Failed("warns: " + "; ".join(faults))
    return "; ".join(f"warns: {text} ({reason})" for text, reason in remarks.items())


def _first_words(text: str) -> str:
    """A warning on one line, without its colours; some of PettingZoo's go on for six lines."""
    return textwrap.shorten(re.sub(r"\x1b\[[0-9;]*m", "", text), 240, placeholder=" ...")


def _excuse(text: str, allowed: tuple[str, ...]) -> str | None:
    if any(re.search(pattern, text) for pattern in allowed):
        return "allowed"
    return next((reason for pattern, reason in RECOMMENDATIONS.items() if re.search(pattern, text)), None)


@contextlib.contextmanager
def _without_a_screen() -> Iterator[None]:
    """Where no display is set, SDL (pygame) draws into memory instead of failing."""
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or os.environ.get("SDL_VIDEODRIVER"):
        yield
        return
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    try:
        yield
    finally:
        del os.environ["SDL_VIDEODRIVER"]
