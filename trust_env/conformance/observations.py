"""Spaces and observations: spaces stay the same objects, observations lie in them and are not overwritten."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from gymnasium import spaces

from trust_env.conformance.difference import difference
from trust_env.conformance.report import Failed
from trust_env.conformance.rollout import Env, Frame, advance, begin, replay
from trust_env.conformance.subject import Check, Subject


def spaces_are_stable(subject: Subject) -> None:
    """The same space object at each call: libraries seed it once and then sample it."""
    env = subject.env()
    declared = hasattr(env, "possible_agents")  # otherwise agents and their spaces are made at each reset
    found = _spaces(env, env.possible_agents) if declared else {}
    env.reset(seed=subject.seed)
    found = found or _spaces(env, env.agents)
    _compare_spaces(env, found, "after reset")
    if len(subject.reference) > 1:
        env.step(copy.deepcopy(subject.reference[1].actions))
        _compare_spaces(env, found, "after a step")


def _spaces(env: Env, agents: list[Any]) -> dict[tuple[str, Any], Any]:
    kinds = ("observation_space", "action_space")
    return {(kind, agent): getattr(env, kind)(agent) for agent in agents for kind in kinds}


def _compare_spaces(env: Env, found: dict[tuple[str, Any], Any], moment: str) -> None:
    for (kind, agent), space in found.items():
        if not isinstance(space, spaces.Space):
            raise Failed(f"{kind}({agent!r}) is a {type(space).__name__}, not a gymnasium.spaces.Space")
        if getattr(env, kind)(agent) is not space:
            raise Failed(f"{kind}({agent!r}) {moment} is another object than before")


def observations_in_space(subject: Subject) -> str:
    """Each observation lies in the agent's space and has exactly its dtype, without a cast."""
    env = subject.env()
    first = begin(env, subject.seed)
    _check_observations(env, first)
    for frame in advance(env, first, subject.make_policy(env, subject.seed), len(subject.reference) - 1):
        _check_observations(env, frame)
    return subject.episode_remark


def _check_observations(env: Env, frame: Frame) -> None:
    for agent in dict.fromkeys([*frame.agents, *frame.terminations]):
        where = f"frame {frame.number}, observation of {agent}"
        if agent not in frame.observations:
            raise Failed(f"{where}: missing")
        problem = _outside(env.observation_space(agent), frame.observations[agent])
        if problem:
            raise Failed(where + problem)


def _outside(space: spaces.Space[Any], value: Any) -> str | None:
    """Why a value is not in its space, after the path to it, or None."""
    if isinstance(space, spaces.Dict) and isinstance(value, dict) and value.keys() == space.spaces.keys():
        members = [(f"[{key!r}]", space[key], value[key]) for key in space.spaces]
    elif isinstance(space, spaces.Tuple) and isinstance(value, tuple) and len(value) == len(space.spaces):
        members = [(f"[{i}]", space[i], value[i]) for i in range(len(value))]
    elif isinstance(space, spaces.Box) and isinstance(value, np.ndarray):
        return _outside_box(space, value)
    else:
        return None if space.contains(value) else f": {value!r} is not in {space}"
    return next((path + problem for path, s, v in members if (problem := _outside(s, v))), None)


def _outside_box(box: spaces.Box, value: np.ndarray) -> str | None:
    if value.dtype != box.dtype or value.shape != box.shape:
        return f": {value.dtype}{list(value.shape)}, its space says {box.dtype}{list(box.shape)}"
    wrong = np.argwhere(~((value >= box.low) & (value <= box.high)))  # NaN is wrong too
    if not len(wrong):
        return None
    at = tuple(int(i) for i in wrong[0])
    return f"[{', '.join(map(str, at))}]: {value[at]} is not between {box.low[at]} and {box.high[at]}"


def observations_not_overwritten(subject: Subject) -> str:
    """An observation is not changed by the next step, which would corrupt a learner's memory."""
    env, policy = subject.env(), replay(subject.reference[1:])
    given, _ = env.reset(seed=subject.seed)
    for number in range(1, len(subject.reference)):
        if not env.agents:
            break
        before = copy.deepcopy(given)
        following = env.step(policy({}, {}))[0]
        changed = difference(before, given)
        if changed:
            path, old, new = changed
            raise Failed(f"frame {number - 1}, observations{path}: {old} became {new} in the next step")
        given = following
    return subject.episode_remark


CHECKS: dict[str, Check] = {
    "spaces_are_stable": spaces_are_stable,
    "observations_in_space": observations_in_space,
    "observations_not_overwritten": observations_not_overwritten,
}
