"""What `reset` and `step` return for each agent, checked in every frame of the reference episode."""

from __future__ import annotations

import math
from typing import Any

from trust_env.conformance.report import Failed
from trust_env.conformance.rollout import Frame
from trust_env.conformance.subject import Check, Subject


def value_types(subject: Subject) -> str:
    """Rewards are finite Python floats (an int will do), terminations and truncations Python bools."""
    for frame in subject.reference:
        _check_rewards(frame)
        _check_flags(frame, "termination", frame.terminations)
        _check_flags(frame, "truncation", frame.truncations)
    return subject.episode_remark


def _check_rewards(frame: Frame) -> None:
    for agent, reward in frame.rewards.items():
        if not isinstance(reward, (float, int)) or isinstance(reward, bool) or not math.isfinite(reward):
            found = f"{reward!r} ({type(reward).__name__})"
            raise Failed(f"frame {frame.number}, reward of {agent}: {found}, not a finite float")


def _check_flags(frame: Frame, name: str, flags: dict[Any, Any]) -> None:
    for agent, flag in flags.items():
        if type(flag) is not bool:
            found = type(flag).__name__
            raise Failed(f"frame {frame.number}, {name} of {agent}: a {found}, not a Python bool")


def infos_keep_their_keys(subject: Subject) -> str:
    """An agent's info has the same keys from reset on; libraries that stack infos drop or reject new ones."""
    keys: dict[Any, set[Any]] = {}
    for frame in subject.reference:
        for agent, info in frame.infos.items():
            known = keys.setdefault(agent, set(info))
            if set(info) != known:
                changes = _describe_changes(known, set(info))
                raise Failed(f"frame {frame.number}, info of {agent}: {changes}")
    return subject.episode_remark


def _describe_changes(old: set[Any], new: set[Any]) -> str:
    lost, gained = sorted(map(repr, old - new)), sorted(map(repr, new - old))
    changes = (("lost", lost), ("gained", gained))
    return " and ".join(f"{verb} {', '.join(keys)}" for verb, keys in changes if keys)


def dicts_match_agents(subject: Subject) -> str:
    """A step returns entries of the agents that were alive or are new; `agents` omits those that finished."""
    live = _distinct(subject.reference[0].agents, 0)
    for frame in subject.reference:
        expected = live | _distinct(frame.agents, frame.number)
        for name in ("observations", "rewards", "terminations", "truncations", "infos"):
            if frame.number == 0 and name not in ("observations", "infos"):
                continue
            _require_equal(f"frame {frame.number}, {name}", set(getattr(frame, name)), expected)
        over = {a for a in expected if frame.terminations.get(a) or frame.truncations.get(a)}
        _require_equal(f"frame {frame.number}, agents", set(frame.agents), expected - over)
        live = set(frame.agents)
    return subject.episode_remark


def _distinct(agents: list[Any], number: int) -> set[Any]:
    if len(set(agents)) < len(agents):
        raise Failed(f"frame {number}: an agent stands twice in {agents}")
    return set(agents)


def _require_equal(where: str, found: set[Any], expected: set[Any]) -> None:
    missing, unexpected = sorted(map(str, expected - found)), sorted(map(str, found - expected))
    if missing:
        raise Failed(f"{where}: lacks {', '.join(missing)}")
    if unexpected:
        raise Failed(f"{where}: has {', '.join(unexpected)}, which should not be there")


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
    return subject.episode_remark


CHECKS: dict[str, Check] = {
    "value_types": value_types,
    "infos_keep_their_keys": infos_keep_their_keys,
    "dicts_match_agents": dicts_match_agents,
    "agents_never_revive": agents_never_revive,
}
