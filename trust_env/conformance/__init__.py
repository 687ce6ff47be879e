"""Checks of any `ParallelEnv`: PettingZoo's own tests by name, and stricter ones.

    report = check(simple_spread_v3.parallel_env)    # a factory: every check starts from a fresh environment
    print(report); report.ok; report.to_dict()

PettingZoo's `parallel_seed_test` ends after one step (it asks `any(terminations)`, which looks at the agents'
names), so it passes runs that differ later; and none of PettingZoo's tests copies, pickles or restores an
environment. The other families of checks, one per file, close these gaps.
"""

from __future__ import annotations

import contextlib
import io
import time
import warnings
from collections.abc import Callable, Collection, Iterator
from typing import Any

import trust_env.conformance.continuation as continuation
import trust_env.conformance.contract as contract
import trust_env.conformance.determinism as determinism
import trust_env.conformance.observations as observations
import trust_env.conformance.pettingzoo_tests as pettingzoo_tests
import trust_env.conformance.resources as resources
from trust_env.conformance.report import Failed, Report, Result, Skipped, describe_error
from trust_env.conformance.rollout import Env, PolicyFactory, random_policy
from trust_env.conformance.subject import Check, Subject

__all__ = ["CHECKS", "Report", "Result", "check", "random_policy"]

# In the order they run. Checks that compare two runs come after determinism, without which they say nothing.
CHECKS: dict[str, Check] = {
    **pettingzoo_tests.CHECKS,
    **observations.CHECKS,
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

    An episode is played to its end, or for `num_cycles` steps or `max_seconds` at most; a check's detail says
    so where it saw only the first steps. `policy(env, seed)` returns the function that chooses the
    actions from the live agents' observations and infos; PettingZoo's own tests always sample.
    `allow_warnings` are regular expressions of warnings that do not fail PettingZoo's tests.
    """
    unknown = set(checks or ()) - CHECKS.keys()
    if unknown:
        raise ValueError(f"unknown checks {sorted(unknown)}; known: {', '.join(CHECKS)}")
    subject = Subject(make_env, aec, seed, num_cycles, max_seconds, policy, tuple(allow_warnings))
    for name, run in CHECKS.items():
        if checks is None or name in checks:
            with _silence():
                subject.results[name] = result = _result_of(name, run, subject)
            if on_result:
                on_result(result)
    with _silence():
        return Report(subject.name, seed, tuple(subject.results.values()))


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Discard what tests and environments print and, outside of PettingZoo's tests, their warnings."""
    with contextlib.ExitStack() as stack:
        stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
        stack.enter_context(contextlib.redirect_stderr(io.StringIO()))
        stack.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore")
        yield


def _result_of(name: str, run: Check, subject: Subject) -> Result:
    """The result of one check; an unexpected exception is a failure."""
    started = time.perf_counter()
    status, detail = "passed", ""
    try:
        detail = run(subject) or ""
    except Skipped as reason:
        status, detail = "skipped", str(reason)
    except Failed as failure:
        status, detail = "failed", str(failure)
    except Exception as error:
        status, detail = "failed", describe_error(error)
    finally:
        subject.close_environments()
    return Result(name, status, detail, time.perf_counter() - started)
