"""Actions as the faces receive them, checked before anything of a world changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


class StagedActions:
    """The actions of all agents of one world, float64[K, A], copied from a dict of arrays."""

    def __init__(self, agents: Sequence[str], size: int):
        self._agents, self._size, self._shape = list(agents), size, (size,)
        self._actions = np.zeros((len(self._agents), size))
        self._rows, self._flat = list(self._actions), self._actions.reshape(-1)
        self._finite = np.zeros(self._actions.size, dtype=bool)

    def take(self, actions: Mapping[str, Any]) -> np.ndarray:
        """The actions as an array, good until the next call. ValueError names the agent whose action is missing,
        unknown, of a wrong shape or not finite.
        """
        shape = self._shape
        try:
            for agent, row in zip(self._agents, self._rows, strict=True):
                action = actions[agent]
                if type(action) is not np.ndarray or action.shape != shape or action.dtype.char not in "fd":
                    action = self._as_array(agent, action)
                row[...] = action
        except (KeyError, TypeError):
            raise self._not_these_agents(actions) from None
        if len(actions) != len(self._rows):
            raise self._not_these_agents(actions)
        if b"\0" in np.isfinite(self._flat, self._finite).tobytes():  # half the time of .all()
            k, entry = np.argwhere(~np.isfinite(self._actions))[0]
            found = f"entry {entry} is {self._actions[k, entry]}"
            raise ValueError(f"the action of {self._agents[k]} must be finite; {found}")
        return self._actions

    def _as_array(self, agent: str, action: Any) -> np.ndarray:
        try:
            array = np.asarray(action)
        except (TypeError, ValueError) as error:
            raise ValueError(f"the action of {agent} must be {self._size} numbers: {error}") from None
        if array.shape != (self._size,) or array.dtype.kind not in "fiub":
            expected = f"{self._size} finite numbers, Box(-1, 1, ({self._size},))"
            found = f"shape {list(array.shape)} of {array.dtype}"
            raise ValueError(f"the action of {agent} must be {expected}; got {found}")
        return array

    def _not_these_agents(self, actions: Mapping[str, Any]) -> ValueError:
        expected = f"one action for each of {', '.join(self._agents)}"
        if not isinstance(actions, Mapping):
            return ValueError(f"step expects {expected}, by name; got {type(actions).__name__}")
        missing = [agent for agent in self._agents if agent not in actions]
        unknown = [str(agent) for agent in actions if agent not in self._agents]
        faults = {"missing": missing, "unknown": unknown}
        found = [f"{fault}: {', '.join(agents)}" for fault, agents in faults.items() if agents]
        return ValueError(f"step expects {expected}; {'; '.join(found)}")


def checked_actions(actions: Any, shape: tuple[int, ...], agents: Sequence[str]) -> np.ndarray:
    """Actions of many worlds as an array [W, K, A]. ValueError for another shape, or what is not finite."""
    array = np.asarray(actions)
    if array.shape != shape or array.dtype.kind not in "fiub":
        found = f"{list(array.shape)} of {array.dtype}"
        raise ValueError(f"actions must be numbers of shape {list(shape)} (worlds, agents, entries); got {found}")
    if not np.isfinite(array).all():
        w, k, entry = np.argwhere(~np.isfinite(array))[0]
        found = f"world {w}, {agents[k]}, entry {entry} is {array[w, k, entry]}"
        raise ValueError(f"actions must be finite; {found}")
    return array
