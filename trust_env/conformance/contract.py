"""What every call of the API promises, looked at in every frame of an episode."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
from gymnasium import spaces

from trust_env.conformance.difference import difference
from trust_env.conformance.report import Check, Failed
from trust_env.conformance.rollout import Env, Frame, advance, begin, replay
from trust_env.conformance.subject import Subject


def spaces_are_stable(subject: Subject) -> None:
    """The same space object at each call: libraries seed it once and sample it ever after."""
    env = subject.env()
    declared = hasattr(env, "possible_agents")  # else agents, and their spaces, are made up at each reset
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
    """Each observation lies in the agent's space and has its very dtype, NumPy's casts not allowed for."""
    env = subject.env()
    first = begin(env, subject.seed)
    _look_at_observations(env, first)
    for frame in advance(env, first, subject.make_policy(env, subject.seed), len(subject.reference) - 1):
        _look_at_observations(env, frame)
    return subject.extent


def _look_at_observations(env: Env, frame: Frame) -> None:
    for agent in dict.fromkeys([*frame.agents, *frame.terminations]):
        where = f"frame {frame.number}, observation of {agent}"
        if agent not in frame.observations:
            raise Failed(f"{where}: missing")
        fault = _outside(env.observation_space(agent), frame.observations[agent])
        if fault:
            raise Failed(where + fault)


def _outside(space: spaces.Space[Any], value: Any) -> str | None:
    """What keeps a value out of its space, its path first."""
    if isinstance(space, spaces.Dict) and isinstance(value, dict) and value.keys() == space.spaces.keys():
        members = [(f"[{key!r}]", space[key], value[key]) for key in space.spaces]
    elif isinstance(space, spaces.Tuple) and isinstance(value, tuple) and len(value) == len(space.spaces):
        members = [(f"[{i}]", space[i], value[i]) for i in range(len(value))]
    elif isinstance(space, spaces.Box) and isinstance(value, np.ndarray):
        return _outside_box(space, value)
    else:
        return None if space.contains(value) else f": {value!r} is not in {space}"
    return next((path + fault for path, s, v in members if (fault := _outside(s, v))), None)


def _outside_box(box: spaces.Box, value: np.ndarray) -> str | None:
    if value.dtype != box.dtype or value.shape != box.shape:
        return f": {value.dtype}{list(value.shape)}, its space says {box.dtype}{list(box.shape)}"
    wrong = np.argwhere(~((value >= box.low) & (value <= box.high)))  # NaN is wrong too
    if not len(wrong):
        return None
    at = tuple(int(i) for i in wrong[0])
    return f"[{', '.join(map(str, at))}]: {value[at]} is not between {box.low[at]} and {box.high[at]}"


def observations_not_overwritten(subject: Subject) -> str:
    """What an agent was given stays as it was: overwriting it would corrupt a learner's memory."""
    env, policy = subject.env(), replay(subject.reference[1:])
    given, _ = env.reset(seed=subject.seed)
    for number in range(1, len(subject.reference)):
        if not env.agents:
            break
        before = copy.deepcopy(given)
        following = env.step(policy({}, {}))[0]
        found = difference(before, given)
        if found:
            raise Failed(
                f"frame {number - 1}, observations{found[0]}: {found[1]} became {found[2]} in the next step"
            )
        given = following
    return subject.extent


def value_types(subject: Subject) -> str:
    """Rewards are finite Python floats (an int will do), terminations and truncations Python bools."""
    for frame in subject.reference:
        for agent, reward in frame.rewards.items():
            if not isinstance(reward, (float, int)) or isinstance(reward, bool) or not math.isfinite(reward):
                kind = type(reward).__name__
                raise Failed(
                    f"frame {frame.number}, reward of {agent}: {reward!r} ({kind}), not a finite float"
                )
        for name, flags in (("termination", frame.terminations), ("truncation", frame.truncations)):
            for agent, flag in flags.items():
                if type(flag) is not bool:
                    raise Failed(
                        f"frame {frame.number}, {name} of {agent}: a {type(flag).__name__}, not a Python bool"
                    )
    return subject.extent


def infos_keep_their_keys(subject: Subject) -> str:
    """An agent's info has the same keys from reset on; libraries that stack infos drop or refuse new ones."""
    keys: dict[Any, set[Any]] = {}
    for frame in subject.reference:
        for agent, info in frame.infos.items():
            known = keys.setdefault(agent, set(info))
            if set(info) != known:
                lost, new = sorted(map(repr, known - set(info))), sorted(map(repr, set(info) - known))
                changes = [f"lost {', '.join(lost)}"] * bool(lost) + [f"gained {', '.join(new)}"] * bool(new)
                raise Failed(f"frame {frame.number}, info of {agent}: {' and '.join(changes)}")
    return subject.extent


def dicts_match_agents(subject: Subject) -> str:
    """Each step answers exactly the agents that were alive or are new; `agents` drops those that finished."""
    live = _distinct(subject.reference[0].agents, 0)
    for frame in subject.reference:
        concerned = live | _distinct(frame.agents, frame.number)
        for name in ("observations", "rewards", "terminations", "truncations", "infos"):
            if frame.number == 0 and name not in ("observations", "infos"):
                continue
            _match(f"frame {frame.number}, {name}", set(getattr(frame, name)), concerned)
        over = {a for a in concerned if frame.terminations.get(a) or frame.truncations.get(a)}
        _match(f"frame {frame.number}, agents", set(frame.agents), concerned - over)
        live = set(frame.agents)
    return subject.extent


def _distinct(agents: list[Any], number: int) -> set[Any]:
    if len(set(agents)) < len(agents):
        raise Failed(f"frame {number}: an agent stands twice in {agents}")
    return set(agents)


def _match(where: str, found: set[Any], expected: set[Any]) -> None:
    lacking, surplus = sorted(map(str, expected - found)), sorted(map(str, found - expected))
    if lacking:
        raise Failed(f"{where}: lacks {', '.join(lacking)}")
    if surplus:
        raise Failed(f"{where}: has {', '.join(surplus)}, which should not be there")


def agents_never_revive(subject: Subject) -> str:
    """An agent that finished, or left `agents`, stays away until the next reset."""
    gone: dict[Any, int] = {}
    live: set[Any] = set()
    for frame in subject.reference:
        back = sorted(str(agent) for agent in frame.agents if agent in gone)
        if back:
            first = next(agent for agent in gone if str(agent) == back[0])
            raise Failed(f"frame {frame.number}: {back[0]} is back, which left in frame {gone[first]}")
        over = {a for a in live if frame.terminations.get(a) or frame.truncations.get(a)}
        gone.update(dict.fromkeys((live - set(frame.agents)) | over, frame.number))
        live = set(frame.agents) - over
    return subject.extent


CHECKS: dict[str, Check] = {
    "spaces_are_stable": spaces_are_stable,
    "observations_in_space": observations_in_space,
    "observations_not_overwritten": observations_not_overwritten,
    "value_types": value_types,
    "infos_keep_their_keys": infos_keep_their_keys,
    "dicts_match_agents": dicts_match_agents,
    "agents_never_revive": agents_never_revive,
}
