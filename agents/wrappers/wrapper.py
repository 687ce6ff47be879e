"""What a view is: it stands between a learner and the environment, in one world or in a batch."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

import numpy as np
from gymnasium.spaces import Space

from trust_env.agents.base import PolicyContext
from trust_env.agents.parameters import refuse
from trust_env.spaces.action import ActionTable
from trust_env.spaces.observation import KNOWLEDGE
from trust_env.spec import Spec


class View:
    """Choices of learners become raw actions; observations become what the learners see.

    knowledge: the level whose fields of the observation a learner sees. None: the scenario's at the first
    `reset`; the view then names it (`str(view)`), so that a policy sees the same at any higher level.
    """

    name: ClassVar[str] = "view"
    hidden: ClassVar[frozenset[str]] = frozenset()  # fields that a learner is not shown
    remembered: ClassVar[tuple[str, ...]] = ()  # attributes that are the view's state, arrays [W, ...]

    observation_size: int  # O', after `reset`
    action_space: Space  # of one learner, after `reset`
    fields: dict[str, int]  # names and lengths of the observation's fields that are shown, after `reset`

    _context: PolicyContext | None = None

    def __init__(self, knowledge: str | None = None):
        if knowledge is not None and knowledge not in KNOWLEDGE:
            raise refuse(self.name, "knowledge", knowledge, f"one of {', '.join(KNOWLEDGE)}, or None")
        self.knowledge = knowledge

    @property
    def context(self) -> PolicyContext:
        if self._context is None:
            raise RuntimeError(f"{self.name}: call reset(context) first")
        return self._context

    def reset(self, context: PolicyContext) -> None:
        """Begin an episode in the worlds of `context.mask`; the others go on."""
        goes_on = self._context is not None and self._context.fits(context)
        self._context = context
        if not goes_on:
            self._show_fields(context)
            self._action_size = ActionTable(context.scenario).size
            self.observation_size = sum(self.fields.values()) + self.prepare(context)
        self.begin(context.mask)

    def _show_fields(self, context: PolicyContext) -> None:
        self.knowledge = self.knowledge or context.scenario.knowledge
        if KNOWLEDGE[self.knowledge] > KNOWLEDGE[context.scenario.knowledge]:
            given = f"at most {context.scenario.knowledge}, which scenario {context.scenario.name!r} gives"
            raise refuse(self.name, "knowledge", self.knowledge, given)
        shown = [
            field
            for field in context.observation_table.values()
            if KNOWLEDGE[field.knowledge] <= KNOWLEDGE[self.knowledge] and field.name not in self.hidden
        ]
        self.fields = {field.name: field.slice.stop - field.slice.start for field in shown}
        self._stretches = joined(field.slice for field in shown)

    def observe(self, observations: np.ndarray) -> np.ndarray:
        """What the learners see, float32[W, n, O']: fields of observations[W, n, O], and what
        the view adds.
        """
        seen = np.empty((*observations.shape[:2], self.observation_size), dtype=np.float32)
        start = 0
        for stretch in self._stretches:
            end = start + stretch.stop - stretch.start
            seen[..., start:end] = observations[..., stretch]
            start = end
        self.complete(seen, observations)
        return seen

    def act(self, choices: np.ndarray, observations: np.ndarray) -> np.ndarray:
        """Raw actions float32[W, n, A] for choices[W, n, ...] on observations[W, n, O]; once per frame."""
        raise NotImplementedError(f"{type(self).__name__} needs a method act(self, choices, observations)")

    def prepare(self, context: PolicyContext) -> int:
        """Hook for a new scenario or shape of the batch: set `action_space`, allocate; how many
        numbers `complete` adds.
        """
        raise NotImplementedError(f"{type(self).__name__} needs a method prepare(self, context)")

    def begin(self, mask: np.ndarray) -> None:
        """Hook: forget what was in the worlds of mask[W]."""

    def complete(self, seen: np.ndarray, observations: np.ndarray) -> None:
        """Hook: seen[W, n, O'] holds the fields; add the view's own numbers in [-1, 1] behind them."""

    def get_state(self) -> dict[str, np.ndarray]:
        """Copies of everything that `set_state` needs, after `reset`, to go on bit for bit."""
        return {name: getattr(self, name).copy() for name in self.remembered}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on from a state of `get_state`; ValueError if it comes from other learners."""
        for name in self.remembered:
            own, given = getattr(self, name), np.asarray(state.get(name))
            if own.shape != given.shape or own.dtype != given.dtype:
                raise refuse(
                    self.name, name, f"{given.dtype}{list(given.shape)}", f"{own.dtype}{list(own.shape)}"
                )
            own[...] = given

    def __repr__(self) -> str:
        parameters = inspect.signature(type(self)).parameters
        values = {name: getattr(self, name) for name in parameters}
        changed = {name: value for name, value in values.items() if value != parameters[name].default}
        return str(Spec(self.name, changed))


def joined(slices: Iterable[slice]) -> list[slice]:
    """Slices in order, neighbours made one."""
    found: list[slice] = []
    for one in slices:
        if found and found[-1].stop == one.start:
            one = slice(found.pop().start, one.stop)
        found.append(one)
    return found
