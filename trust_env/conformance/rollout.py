"""Episodes of an environment, with everything that it returns."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

Env = ParallelEnv[Any, Any, Any]
Policy = Callable[[dict[Any, Any], dict[Any, Any]], dict[Any, Any]]  # observations, infos -> actions
PolicyFactory = Callable[[Env, int], Policy]


class Frame(NamedTuple):
    """All that one `reset` (number 0) or `step` returned; `actions` are those of the step."""

    number: int
    actions: dict[Any, Any]
    observations: dict[Any, Any]
    rewards: dict[Any, Any]
    terminations: dict[Any, Any]
    truncations: dict[Any, Any]
    infos: dict[Any, Any]
    agents: list[Any]  # those still alive


def begin(env: Env, seed: int | None = None) -> Frame:
    """The frame of a reset, copied; without a seed the call is a plain `reset()`, as most users write it."""
    observations, infos = env.reset() if seed is None else env.reset(seed=seed)
    return copy.deepcopy(Frame(0, {}, observations, {}, {}, {}, infos, list(env.agents)))


def advance(
    env: Env, frame: Frame, policy: Policy, limit: int, keep: Callable[[Frame], Frame] = copy.deepcopy
) -> Iterator[Frame]:
    """The frames of at most `limit` steps, until no agent is left; `keep` copies them, or does not."""
    for number in range(frame.number + 1, frame.number + 1 + limit):
        if not env.agents:
            return
        live = list(env.agents)
        actions = policy({a: frame.observations.get(a) for a in live}, {a: frame.infos.get(a) for a in live})
        outcome = env.step(actions)
        frame = keep(Frame(number, actions, *outcome, list(env.agents)))
        yield frame


def play(env: Env, policy: Policy, limit: int, seed: int | None = None) -> list[Frame]:
    """The frames of an episode of at most `limit` steps, its reset included."""
    first = begin(env, seed)
    return [first, *advance(env, first, policy, limit)]


def replay(frames: Iterable[Frame]) -> Policy:
    """The policy that repeats the actions of `frames`, whatever it observes."""
    actions = iter([frame.actions for frame in frames])
    return lambda observations, infos: copy.deepcopy(next(actions))


def random_policy(env: Env, seed: int) -> Policy:
    """The policy that samples each agent's action space, within its action mask if it has one.

    The spaces are copies, so that neither the environment's own generators nor another policy's advance.
    """
    copies: dict[Any, spaces.Space[Any]] = {}
    indices = {agent: index for index, agent in enumerate(getattr(env, "possible_agents", ()))}

    def act(observations: dict[Any, Any], infos: dict[Any, Any]) -> dict[Any, Any]:
        actions = {}
        for agent, observation in observations.items():
            if agent not in copies:
                copies[agent] = copy.deepcopy(env.action_space(agent))
                copies[agent].seed(seed + indices.setdefault(agent, len(indices)))
            space = copies[agent]
            actions[agent] = space.sample(mask=action_mask(space, observation, infos[agent]))
        return actions

    return act


def action_mask(space: spaces.Space[Any], observation: Any, info: Any) -> Any:
    """The mask in the observation or in the info, or None; of the dtype that `Discrete.sample` requires."""
    for source in (observation, info):
        if isinstance(source, dict) and source.get("action_mask") is not None:
            mask = source["action_mask"]
            return np.asarray(mask, np.int8) if isinstance(space, spaces.Discrete) else mask
    return None
