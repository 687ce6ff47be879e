"""A seed decides a whole episode and those of later unseeded resets; other seeds give other episodes."""

from __future__ import annotations

from trust_env.conformance.difference import first_difference
from trust_env.conformance.report import Failed, Skipped
from trust_env.conformance.rollout import Env, Frame, play, replay
from trust_env.conformance.subject import Check, Subject

FURTHER_SEEDS = 3  # in a small game a single other seed may give the same episode by chance


def whole_episode_determinism(subject: Subject) -> str:
    """The same seed and actions give the same episode: in another environment, and in a used one."""
    env = subject.env()
    for whose in ("a second fresh environment", "the same environment, reset again with the same seed"):
        again = _repeat(subject, env, subject.seed)
        difference = first_difference(subject.reference, again, ("the first run", whose))
        if difference:
            raise Failed(difference)
    return subject.episode_remark


def seeds_matter(subject: Subject) -> str | None:
    """Some other seed gives another episode."""
    reference = subject.reference
    others = range(subject.seed + 1, subject.seed + 1 + FURTHER_SEEDS)
    if any(_differ(reference, _play(subject, subject.env(), seed)) for seed in others):
        return None
    if not _is_random(subject):
        raise Skipped("nothing in this environment is random: episodes without a seed are all the same, too")
    raise Failed(f"seeds {subject.seed} to {others[-1]} all give the same episode")


def unseeded_second_reset(subject: Subject) -> str | None:
    """`reset()` after a seeded episode starts another one, and the seed decides that one too."""
    first, second = _second_episode(subject), _second_episode(subject)
    difference = first_difference(first, second, ("the first run", "a second run"))
    if difference:
        subject.fail_if_deterministic(f"the episode after an unseeded reset: {difference}")
    if _differ(subject.reference, first):
        return None
    if not _is_random(subject):
        raise Skipped("nothing in this environment is random")
    raise Failed("an unseeded reset repeats the seeded episode before it")


def _second_episode(subject: Subject) -> list[Frame]:
    """The episode of an unseeded reset after the reference episode."""
    env = subject.env()
    _repeat(subject, env, subject.seed)
    return _play(subject, env, None)


def _repeat(subject: Subject, env: Env, seed: int) -> list[Frame]:
    """An episode with the reference episode's actions, as long as that one."""
    return play(env, replay(subject.reference[1:]), len(subject.reference) - 1, seed)


def _play(subject: Subject, env: Env, seed: int | None) -> list[Frame]:
    """An episode with a new policy, whose actions are valid whatever the seed; as long as the reference."""
    return play(env, subject.make_policy(env, subject.seed), len(subject.reference) - 1, seed)


def _differ(first: list[Frame], second: list[Frame]) -> bool:
    return first_difference(first, second, ("", "")) is not None


def _is_random(subject: Subject) -> bool:
    """Whether another seed, or none, gives another episode than the reference."""
    env = subject.env()
    seeds = (subject.seed + 1, None, None)
    return any(_differ(subject.reference, _play(subject, env, seed)) for seed in seeds)


CHECKS: dict[str, Check] = {
    "whole_episode_determinism": whole_episode_determinism,
    "seeds_matter": seeds_matter,
    "unseeded_second_reset": unseeded_second_reset,
}
