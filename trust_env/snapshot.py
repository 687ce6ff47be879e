"""Whether a snapshot of an environment is one, and of this scenario and defense."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from trust_env.batch import Batch
from trust_env.user_code import missing_methods

ENTRIES = ("row", "agents", "started", "defense")


def check_snapshot(state: Any, worlds: Batch, possible_agents: list[str]) -> None:
    """ValueError, naming the entry, for what is no snapshot of an environment of these worlds."""
    if not isinstance(state, Mapping):
        raise ValueError(f"a snapshot is what get_state() returned, a dict; got a {type(state).__name__}")
    missing = [name for name in ENTRIES if name not in state]
    if missing:
        raise ValueError(f"the snapshot lacks {', '.join(map(repr, missing))}; expected what get_state() returned")
    _check_row(state["row"], worlds.rows.shape[1])
    agents = state["agents"]
    if not isinstance(agents, list) or (agents and agents != possible_agents):
        raise ValueError(f"the snapshot's 'agents' are {agents!r}; expected {possible_agents} or []")
    if not isinstance(state["started"], bool):
        raise ValueError(f"the snapshot's 'started' is {state['started']!r}; expected True or False")
    _check_defense(state["defense"], worlds)


def _check_row(row: Any, size: int) -> None:
    if not isinstance(row, np.ndarray) or row.dtype != np.uint8:
        kind = row.dtype if isinstance(row, np.ndarray) else type(row).__name__
        raise ValueError(f"the snapshot's 'row' must be an array of uint8; got {kind}")
    if row.shape != (size,):
        raise ValueError(
            f"the snapshot's row is of shape {list(row.shape)}; a world of this scenario and defense holds {size} bytes"
        )


def _check_defense(defense: Any, worlds: Batch) -> None:
    if (defense is None) != (worlds.own_defense is None):
        own = ["a built-in defense", "a user's own defense"]
        found, expected = own[defense is not None], own[worlds.own_defense is not None]
        raise ValueError(f"the snapshot is of an environment with {found}; this one has {expected}")
    fault = "" if defense is None else missing_methods(defense, "reset(shape, worlds)", "update(evidence)")
    if fault:
        raise ValueError(f"the snapshot's defense: {fault}")
