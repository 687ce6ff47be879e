"""Is this environment correct? PettingZoo's own tests by name, and stricter ones, on any `ParallelEnv`.

    report = check(simple_spread_v3.parallel_env)    # a factory: every check starts from a fresh environment
    print(report); report.ok; report.to_dict()

PettingZoo's `parallel_seed_test` ends after one step (it asks `any(terminations)`, which looks at the agents'
names), so a run that goes astray later passes it; and no test of PettingZoo's copies, pickles or restores an
environment. The checks of `determinism`, `continuation`, `contract` and `resources` close these gaps.
"""

from __future__ import annotations

import contextlib
import io
import time
import warnings
from collections.abc import Callable, Collection, Iterator
from typing import Any

from trust_env.conformance import continuation, contract, determinism, pettingzoo_tests, resources
from trust_env.conformance.report import Check, Failed, Report, Result, Skipped, described
from trust_env.conformance.rollout import Env, PolicyFactory, random_policy
from trust_env.conformance.subject import Subject

__all__ = ["CHECKS", "Report", "Result", "check", "random_policy"]

# In the order they run. What compares two runs comes after determinism, without which it says nothing.
CHECKS: dict[str, Check] = {
    **pettingzoo_tests.CHECKS,
    **contract.CHECKS,
    **determinism.CHECKS,
    **continuation.CHECKS,
    **resources.CHECKS,
}


def check(
    make_env: Callable[..., Env] | Env,
    *,
    aec: Callable[..., Any] | None = None,
    seed: int = 0,
    num_cycles: int = 1000,
    max_seconds: float = 5.0,
    policy: PolicyFactory = random_policy,
    checks: Collection[str] | None = None,
    allow_warnings: Collection[str] = (),
    on_result: Callable[[Result], None] | None = None,
) -> Report:
    """Run all checks, or those named in `checks`, and report each.

    `make_env` returns a fresh environment at each call; where it accepts `render_mode` and `max_cycles`,
    those are tested too. An environment itself will do, if it survives `copy.deepcopy`. `aec` makes the AEC
    form for the tests of PettingZoo that want one; by default `parallel_to_aec` does.

    An episode is followed to its end, but for `num_cycles` steps or `max_seconds` at most; the detail of a
    check says so when it saw only the beginning. `policy(env, seed)` returns the function that chooses the
    actions, from the live agents' observations and infos; PettingZoo's own tests always sample.
    `allow_warnings` are regular expressions of warnings that shall not fail PettingZoo's tests.
    """
    unknown = set(checks or ()) - CHECKS.keys()
    if unknown:
        raise ValueError(f"unknown checks {sorted(unknown)}; known: {', '.join(CHECKS)}")
    subject = Subject(make_env, aec, seed, num_cycles, max_seconds, policy, tuple(allow_warnings))
    for name, run in CHECKS.items():
        if checks is None or name in checks:
            with _quiet():
                subject.results[name] = result = _judge(name, run, subject)
            if on_result:
                on_result(result)
    with _quiet():
        return Report(subject.name, seed, tuple(subject.results.values()))


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep back what tests and environments print; warnings count in PettingZoo's tests, and only there."""
    with contextlib.ExitStack() as stack:
        stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
        stack.enter_context(contextlib.redirect_stderr(io.StringIO()))
        stack.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore")
        yield


def _judge(name: str, run: Check, subject: Subject) -> Result:
    """One check's result. An exception that it does not expect is the environment's failure."""
    started = time.perf_counter()
    status, detail = "passed", ""
    try:
        detail = run(subject) or ""
    except Skipped as reason:
        status, detail = "skipped", str(reason)
    except Failed as fault:
        status, detail = "failed", str(fault)
    except Exception as error:
        status, detail = "failed", described(error)
    finally:
        subject.close_environments()
    return Result(name, status, detail, time.perf_counter() - started)
