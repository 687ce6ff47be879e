"""A copy, a pickle and a snapshot, taken in mid-episode, go on bit for bit as the original does."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

from trust_env.conformance.difference import first_difference
from trust_env.conformance.report import Check, Failed, Skipped, described
from trust_env.conformance.rollout import Env, Frame, advance, begin, replay
from trust_env.conformance.subject import Subject


def copy_mid_episode(subject: Subject) -> str:
    """`copy.deepcopy` carries all state, and shares none."""
    return _check_twin(subject, copy.deepcopy, "the copy")


def pickle_mid_episode(subject: Subject) -> str:
    """So does a pickle."""
    return _check_twin(subject, lambda env: pickle.loads(pickle.dumps(env)), "the unpickled environment")


def _check_twin(subject: Subject, duplicate: Callable[[Env], Env], twins: str) -> str:
    """The twin goes first, to the end and into the next episode: whatever it shares shows in the original."""
    env = _at_the_middle(subject, subject.env())
    try:
        twin = duplicate(env)
        of_twin, next_of_twin = _rest(subject, twin), _next_episode(subject, twin)
    except Exception as error:
        fault = f"taken at frame {_middle(subject)}, {twins} fails"
        raise Failed(f"{fault}: {described(error)}") from error
    of_env, next_of_env = _rest(subject, env), _next_episode(subject, env)
    if subject.failed("whole_episode_determinism"):  # the reference is another episode then
        _compare(subject, of_env, of_twin, ("the original", twins), "they part")
    else:
        untouched, original = "an untouched run", "the original"
        _compare(subject, _expected(subject), of_twin, (original, twins), "it goes another way")
        _compare(subject, _expected(subject), of_env, (untouched, original), f"{twins} disturbs the original")
    _compare(subject, next_of_env, next_of_twin, ("the original", twins), "the next unseeded reset differs")
    return _remark(subject)


def snapshot_mid_episode(subject: Subject) -> str:
    """`set_state` takes the environment back, and another one, that was elsewhere, to the same place."""
    env: Any = _at_the_middle(subject, subject.env())
    other: Any = subject.env()
    if not (hasattr(env, "get_state") and hasattr(env, "set_state")):
        raise Skipped("the environment has no get_state() and set_state()")
    state = env.get_state()
    first = _rest(subject, env)
    if not subject.failed("whole_episode_determinism"):
        names = ("an untouched run", "the original")
        _compare(subject, _expected(subject), first, names, "get_state() disturbs it")
    env.set_state(state)
    _compare(subject, first, _rest(subject, env), ("the first time", "after set_state()"), "they part")
    begin(other, subject.seed + 1)
    other.set_state(state)
    names = ("the original", "another environment after set_state()")
    _compare(subject, first, _rest(subject, other), names, "they part")
    return _remark(subject)


def _middle(subject: Subject) -> int:
    return (len(subject.reference) - 1) // 2


def _at_the_middle(subject: Subject, env: Env) -> Env:
    """Play the reference episode up to its middle frame."""
    first = begin(env, subject.seed)
    for _ in advance(env, first, replay(subject.reference[1:]), _middle(subject)):
        pass
    return env


def _expected(subject: Subject) -> list[Frame]:
    return subject.reference[_middle(subject) + 1 :]


def _rest(subject: Subject, env: Env) -> list[Frame]:
    """What follows the middle frame, with the reference's actions."""
    rest = _expected(subject)
    return list(advance(env, subject.reference[_middle(subject)], replay(rest), len(rest)))


def _next_episode(subject: Subject, env: Env) -> list[Frame]:
    """The frame of an unseeded reset, where it is known that the seed decides it; else nothing."""
    return [begin(env)] if subject.passed("unseeded_second_reset") else []


def _compare(
    subject: Subject, expected: list[Frame], found: list[Frame], names: tuple[str, str], fault: str
) -> None:
    difference = first_difference(expected, found, names)
    if difference:
        subject.fail_if_deterministic(f"taken at frame {_middle(subject)}, {fault}: {difference}")


def _remark(subject: Subject) -> str:
    return f"taken at frame {_middle(subject)}; {subject.extent}"


CHECKS: dict[str, Check] = {
    "copy_mid_episode": copy_mid_episode,
    "pickle_mid_episode": pickle_mid_episode,
    "snapshot_mid_episode": snapshot_mid_episode,
}
