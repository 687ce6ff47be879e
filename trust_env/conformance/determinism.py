"""A seed decides a whole episode, another seed another one, and what follows without a seed as well."""

from __future__ import annotations

from trust_env.conformance.difference import first_difference
from trust_env.conformance.report import Check, Failed, Skipped
from trust_env.conformance.rollout import Env, Frame, play, replay
from trust_env.conformance.subject import Subject

FURTHER_SEEDS = 3  # a single other seed may give the same episode by chance in a small game


def whole_episode_determinism(subject: Subject) -> str:
    """The same seed and actions give the same episode: in another environment, and in a used one."""
    fresh = subject.env()
    for whose in ("a second fresh environment", "the same environment, reset again with the same seed"):
        again = _repeat(subject, fresh, subject.seed)
        fault = first_difference(subject.reference, again, ("the first run", whose))
        if fault:
            raise Failed(fault)
    return subject.extent


def seeds_matter(subject: Subject) -> str | None:
    """Some other seed gives another episode."""
    own = subject.reference
    others = range(subject.seed + 1, subject.seed + 1 + FURTHER_SEEDS)
    if any(_differ(own, _fresh(subject, subject.env(), seed)) for seed in others):
        return None
    if not _has_chance(subject):
        raise Skipped("nothing in this environment is random: episodes without a seed are all the same, too")
    raise Failed(f"seeds {subject.seed} to {others[-1]} all give the same episode")


def unseeded_second_reset(subject: Subject) -> str | None:
    """`reset()` after a seeded episode starts another one, and the seed decides that one too."""
    first, second = _second_episode(subject), _second_episode(subject)
    fault = first_difference(first, second, ("the first run", "a second run"))
    if fault:
        subject.fail_if_deterministic(f"the episode after an unseeded reset: {fault}")
    if _differ(subject.reference, first):
        return None
    if not _has_chance(subject):
        raise Skipped("nothing in this environment is random")
    raise Failed("an unseeded reset repeats the seeded episode before it")


def _second_episode(subject: Subject) -> list[Frame]:
    env = subject.env()
    _repeat(subject, env, subject.seed)
    return _fresh(subject, env, None)


def _repeat(subject: Subject, env: Env, seed: int) -> list[Frame]:
    """The reference episode's actions once more; they stop where it stopped."""
    return play(env, replay(subject.reference[1:]), len(subject.reference) - 1, seed)


def _fresh(subject: Subject, env: Env, seed: int | None) -> list[Frame]:
    """An episode with the policy in its first state: actions that fit, whatever the seed made of the game."""
    return play(env, subject.make_policy(env, subject.seed), len(subject.reference) - 1, seed)


def _differ(first: list[Frame], second: list[Frame]) -> bool:
    return first_difference(first, second, ("", "")) is not None


def _has_chance(subject: Subject) -> bool:
    """Whether any seed, or none, ever gives another episode than the reference."""
    env = subject.env()
    seeds = (subject.seed + 1, None, None)
    return any(_differ(subject.reference, _fresh(subject, env, seed)) for seed in seeds)


CHECKS: dict[str, Check] = {
    "whole_episode_determinism": whole_episode_determinism,
    "seeds_matter": seeds_matter,
    "unseeded_second_reset": unseeded_second_reset,
}
