"""Copies, pickles and snapshots, taken in mid-episode, continue bit for bit as the original does."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any, NamedTuple

from trust_env.conformance.difference import first_difference
from trust_env.conformance.report import Failed, Skipped, describe_error
from trust_env.conformance.rollout import Env, Frame, advance, begin, replay
from trust_env.conformance.subject import Check, Subject


def copy_mid_episode(subject: Subject) -> str:
    """`copy.deepcopy` copies all state, and shares none."""
    return _check_duplicate(subject, copy.deepcopy, "the copy")


def pickle_mid_episode(subject: Subject) -> str:
    """A pickle holds all state, and shares none."""
    return _check_duplicate(subject, lambda env: pickle.loads(pickle.dumps(env)), "the unpickled environment")


class _Continuation(NamedTuple):
    """What follows the middle frame of an episode, and the first frame of the next one."""

    rest: list[Frame]
    next_episode: list[Frame]


def _check_duplicate(subject: Subject, duplicate: Callable[[Env], Env], name: str) -> str:
    """The duplicate is played first, so that whatever it shares with the original disturbs that one."""
    env = _env_at_middle(subject)
    try:
        of_duplicate = _continue(subject, duplicate(env))
    except Exception as error:
        where = f"taken at frame {_middle(subject)}, {name} fails"
        raise Failed(f"{where}: {describe_error(error)}") from error
    of_original = _continue(subject, env)
    _compare_rests(subject, of_original.rest, of_duplicate.rest, name)
    names, fault = ("the original", name), "the next unseeded reset differs"
    _compare(subject, of_original.next_episode, of_duplicate.next_episode, names, fault)
    return _remark(subject)


def _continue(subject: Subject, env: Env) -> _Continuation:
    rest = _play_rest(subject, env)
    return _Continuation(rest, _next_episode(subject, env))


def _compare_rests(subject: Subject, of_original: list[Frame], of_duplicate: list[Frame], name: str) -> None:
    """Compare both with the reference, or only with each other where the environment is not deterministic."""
    original, untouched = "the original", "an untouched run"
    if subject.failed("whole_episode_determinism"):
        _compare(subject, of_original, of_duplicate, (original, name), "they part")
        return
    expected = _expected_rest(subject)
    _compare(subject, expected, of_duplicate, (original, name), "it goes another way")
    _compare(subject, expected, of_original, (untouched, original), f"{name} disturbs the original")


def snapshot_mid_episode(subject: Subject) -> str:
    """`set_state` restores the snapshot in the same environment, and in another one."""
    env: Any = _env_at_middle(subject)
    if not (hasattr(env, "get_state") and hasattr(env, "set_state")):
        raise Skipped("the environment has no get_state() and set_state()")
    state = env.get_state()
    first = _play_rest(subject, env)
    if not subject.failed("whole_episode_determinism"):
        names = ("an untouched run", "the original")
        _compare(subject, _expected_rest(subject), first, names, "get_state() disturbs it")
    env.set_state(state)
    _compare(subject, first, _play_rest(subject, env), ("the first time", "after set_state()"), "they part")
    other: Any = subject.env()
    begin(other, subject.seed + 1)
    other.set_state(state)
    names = ("the original", "another environment after set_state()")
    _compare(subject, first, _play_rest(subject, other), names, "they part")
    return _remark(subject)


def _middle(subject: Subject) -> int:
    """The number of the reference episode's middle frame."""
    return (len(subject.reference) - 1) // 2


def _env_at_middle(subject: Subject) -> Env:
    """A fresh environment that has played the reference episode up to its middle frame."""
    env = subject.env()
    first = begin(env, subject.seed)
    for _ in advance(env, first, replay(subject.reference[1:]), _middle(subject)):
        pass
    return env


def _expected_rest(subject: Subject) -> list[Frame]:
    return subject.reference[_middle(subject) + 1 :]


def _play_rest(subject: Subject, env: Env) -> list[Frame]:
    """The frames after the middle one, with the reference's actions."""
    rest = _expected_rest(subject)
    return list(advance(env, subject.reference[_middle(subject)], replay(rest), len(rest)))


def _next_episode(subject: Subject, env: Env) -> list[Frame]:
    """The frame of an unseeded reset where that is known to be determined by the seed before; else none."""
    return [begin(env)] if subject.passed("unseeded_second_reset") else []


def _compare(subject: Subject, expected: list[Frame], found: list[Frame], names: tuple[str, str], fault: str) -> None:
    difference = first_difference(expected, found, names)
    if difference:
        subject.fail_if_deterministic(f"taken at frame {_middle(subject)}, {fault}: {difference}")


def _remark(subject: Subject) -> str:
    return f"taken at frame {_middle(subject)}; {subject.episode_remark}"


CHECKS: dict[str, Check] = {
    "copy_mid_episode": copy_mid_episode,
    "pickle_mid_episode": pickle_mid_episode,
    "snapshot_mid_episode": snapshot_mid_episode,
}
