"""What a wrapper is: it stands between a learner and the environment, in one world or in a batch."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

import numpy as np
from gymnasium.spaces import Space

from trust_env.agents.base import PolicyContext
from trust_env.agents.parameters import invalid
from trust_env.spaces.action import ActionTable
from trust_env.spaces.observation import KNOWLEDGE
from trust_env.spec import Spec


class ActionWrapper:
    """Raw actions from the choices of learners, and what the learners see from observations.

    knowledge: the level whose fields of the observation a learner sees. None: the scenario's at the first
    `reset`; the wrapper then names it (`str(wrapper)`), so that a policy sees the same at any higher level.
    """

    name: ClassVar[str] = "wrapper"
    hidden_fields: ClassVar[frozenset[str]] = frozenset()  # of the observation; a learner does not see them
    state_arrays: ClassVar[tuple[str, ...]] = ()  # attributes that are the wrapper's state, arrays [W, ...]

    observation_size: int  # O', after `reset`
    action_space: Space  # of one learner, after `reset`
    fields: dict[str, int]  # names and lengths of the observation's fields that are shown, after `reset`
    first_logits: np.ndarray | None = None  # of all choices one after the other: what exploration begins with

    _context: PolicyContext | None = None

    def __init__(self, knowledge: str | None = None):
        if knowledge is not None and knowledge not in KNOWLEDGE:
            raise invalid(self.name, "knowledge", knowledge, f"one of {', '.join(KNOWLEDGE)}, or None")
        self.knowledge = knowledge

    @property
    def context(self) -> PolicyContext:
        if self._context is None:
            raise RuntimeError(f"{self.name}: call reset(context) first")
        return self._context

    def reset(self, context: PolicyContext) -> None:
        """Begin an episode in the worlds of `context.mask`; the others continue theirs."""
        is_prepared = self._context is not None and self._context.fits(context)
        self._context = context
        if not is_prepared:
            self._choose_fields(context)
            self._action_size = ActionTable(context.scenario).size
            self.observation_size = sum(self.fields.values()) + self.prepare(context)
        self.clear(context.mask)

    def _choose_fields(self, context: PolicyContext) -> None:
        """Which fields of the observation the learners see; ValueError for more than the scenario gives."""
        self.knowledge = self.knowledge or context.scenario.knowledge
        if KNOWLEDGE[self.knowledge] > KNOWLEDGE[context.scenario.knowledge]:
            given = f"at most {context.scenario.knowledge}, which scenario {context.scenario.name!r} gives"
            raise invalid(self.name, "knowledge", self.knowledge, given)
        shown = [
            field
            for field in context.observation_table.values()
            if KNOWLEDGE[field.knowledge] <= KNOWLEDGE[self.knowledge] and field.name not in self.hidden_fields
        ]
        self.fields = {field.name: field.slice.stop - field.slice.start for field in shown}
        self._slices = merge_adjacent(field.slice for field in shown)

    def observe(self, observations: np.ndarray) -> np.ndarray:
        """What the learners see, float32[W, n, O']: fields of observations[W, n, O] and the wrapper's own."""
        seen = np.empty((*observations.shape[:2], self.observation_size), dtype=np.float32)
        start = 0
        for shown in self._slices:
            end = start + shown.stop - shown.start
            seen[..., start:end] = observations[..., shown]
            start = end
        self.add_own_fields(seen, observations)
        return seen

    def act(self, choices: np.ndarray, observations: np.ndarray) -> np.ndarray:
        """Raw actions float32[W, n, A] for choices[W, n, ...] on observations[W, n, O]; once per frame."""
        raise NotImplementedError(f"{type(self).__name__} needs a method act(self, choices, observations)")

    def prepare(self, context: PolicyContext) -> int:
        """Hook for a new scenario or shape of the batch: set `action_space`, allocate. Returns how many
        numbers `add_own_fields` adds.
        """
        raise NotImplementedError(f"{type(self).__name__} needs a method prepare(self, context)")

    def clear(self, mask: np.ndarray) -> None:
        """Hook: begin an episode in the worlds of mask[W]."""

    def add_own_fields(self, seen: np.ndarray, observations: np.ndarray) -> None:
        """Hook: seen[W, n, O'] holds the fields; add the wrapper's own numbers in [-1, 1] behind them."""

    def state(self) -> dict[str, np.ndarray]:
        """The arrays [W, ...] that are the wrapper's state, by name."""
        return {name: getattr(self, name) for name in self.state_arrays}

    def get_state(self) -> dict[str, np.ndarray]:
        """Copies of the arrays from which `set_state`, after `reset`, continues bit for bit."""
        return {name: values.copy() for name, values in self.state().items()}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Continue from a state of `get_state`; ValueError if it comes from other learners."""
        for name, own in self.state().items():
            given = np.asarray(state.get(name))
            if own.shape != given.shape or own.dtype != given.dtype:
                expected = f"{own.dtype}{list(own.shape)}"
                raise invalid(self.name, name, f"{given.dtype}{list(given.shape)}", expected)
            own[...] = given

    def __repr__(self) -> str:
        parameters = inspect.signature(type(self)).parameters
        values = {name: getattr(self, name) for name in parameters}
        changed = {name: value for name, value in values.items() if value != parameters[name].default}
        return str(Spec(self.name, changed))


def merge_adjacent(slices: Iterable[slice]) -> list[slice]:
    """The same slices, those that follow each other without a gap merged."""
    found: list[slice] = []
    for one in slices:
        if found and found[-1].stop == one.start:
            one = slice(found.pop().start, one.stop)
        found.append(one)
    return found
