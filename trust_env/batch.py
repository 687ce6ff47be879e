"""A batch of worlds: memory, threads, episodes. What the faces (PettingZoo, arrays, fusion centre) are thin
layers over.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from trust_env import frame
from trust_env.compiled.layout import ACTIONS, ROW, SCRATCH, aligned_zeros
from trust_env.compiled.threads import WorkerThreads, threads_available, threads_for
from trust_env.defenses import BuiltIn, Defense, Evidence, Shape, TrackerBelief, build_defense
from trust_env.defenses.verdict import apply_verdict
from trust_env.errors import positive_int
from trust_env.exclusive import ExclusiveUse
from trust_env.parameters import Parameters
from trust_env.scenario import Fovs, Scenario, load_scenario
from trust_env.spaces.action import ActionTable
from trust_env.spaces.observation import ObservationTable
from trust_env.user_code import call, source_of
from trust_env.world.fields import FRAME_METRICS, HEAD

SEED_LIMIT = 2**63


def checked_seed(seed: Any) -> int:
    """A seed as int; fresh entropy for None. ValueError for anything but an integer from 0 to 2^63 - 1."""
    if seed is None:
        return int.from_bytes(os.urandom(8), "little") % SEED_LIMIT
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or not 0 <= seed < SEED_LIMIT:
        raise ValueError(f"seed must be an integer from 0 to 2^63 - 1, or None; got {seed!r}")
    return int(seed)


class Arrays(Mapping[str, np.ndarray]):
    """Live views of the worlds' memory by name, with leading axis W; writing to them changes the worlds.

    `trust_env.world.fields` says what each is; `metrics[W, ·]` are all of a frame's in order.
    """

    def __init__(self, parameters: Parameters, rows: np.ndarray, actions: np.ndarray):
        layout, buffers = parameters.layout, {ROW: rows, ACTIONS: actions}
        names = [name for name, field in layout.fields.items() if field.buffer in buffers]
        self._views = {name: layout.view(buffers[layout.fields[name].buffer], name) for name in names}
        first, count = self._views[next(iter(FRAME_METRICS))], len(FRAME_METRICS)
        strides = (*first.strides, first.itemsize)
        self._views["metrics"] = np.lib.stride_tricks.as_strided(first, (*first.shape, count), strides)

    def __getitem__(self, name: str) -> np.ndarray:
        return self._views[name]

    def __getattr__(self, name: str) -> np.ndarray:
        try:
            return self.__dict__["_views"][name]
        except KeyError:
            raise AttributeError(name) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._views)

    def __len__(self) -> int:
        return len(self._views)


class Batch:
    """W worlds of one scenario under one defense.

    threads: how many threads share a frame's work (default: the processors this process may use).

    Whoever calls `start`, `step`, `run_frame` or `run`, which runs stages of `trust_env.frame`, does so within `use`,
    and sets `use.unfinished` to False at the end of what belongs together.
    """

    def __init__(
        self,
        scenario: Any,
        defense: Any,
        num_worlds: int,
        horizon: int | None = None,
        threads: int | None = None,
    ):
        self.scenario: Scenario = load_scenario(scenario)
        self.defense: BuiltIn | Defense = build_defense(defense)
        self.horizon = self.scenario.horizon if horizon is None else positive_int("max_cycles", horizon)
        self.num_worlds = positive_int("num_worlds", num_worlds)
        self.threads = positive_int("threads", threads or threads_available())
        self.use = ExclusiveUse()
        self._allocate()

    def _allocate(self) -> None:
        self.parameters = Parameters(self.scenario, self.defense, self.horizon)
        layout, count = self.parameters.layout, self.num_worlds
        self._head = layout.record(HEAD)
        self.rows, self._actions = (aligned_zeros(count, layout.sizes[b]) for b in (ROW, ACTIONS))
        self.scratch = aligned_zeros(threads_for(count, self.threads), layout.sizes[SCRATCH])
        memory = (self.parameters, self.rows, self._actions, self.scratch)
        self._workers = WorkerThreads(frame.engine(), count, [self._own(s) for s in self.scratch], memory)
        self.arrays = Arrays(self.parameters, self.rows, self._actions)
        self.arrays.dt[...], self.arrays.active[...] = self.scenario.dt, 1
        self._action = self.arrays.action
        self._evidence: Evidence | None = None
        self.run = self._first_run

    def _first_run(self, wanted: int) -> None:
        """Run stages, once the built-in defense is compiled or loaded."""
        if isinstance(self.defense, BuiltIn):
            entry = frame.defense_entry(type(self.defense))
            entry.prepare()
            self.parameters.set(defense=entry.address)
        self.run = self._workers.run
        self.run(wanted)

    def _own(self, scratch: np.ndarray) -> list[int]:
        """What a thread is told of the worlds: `frame.OWN`."""
        rows, actions, parameters = self.rows, self._actions, self.parameters
        found = {
            "rows": rows.ctypes.data,
            "row_bytes": rows.shape[1],
            "parameters": parameters.buffer.ctypes.data,
            "scratch": scratch.ctypes.data,
            "actions": actions.ctypes.data,
            "action_bytes": actions.shape[1],
            "layout": parameters.layout.table.ctypes.data,
        }
        return [found[name] for name in frame.OWN]

    @property
    def roles(self) -> np.ndarray:
        """+1 adversary, -1 benign, int[K]."""
        return self.parameters["role"]

    # --- copies and snapshots ---

    @property
    def own_defense(self) -> Defense | None:
        """A user's own defense, which keeps its memory outside the worlds'; None for a built-in one."""
        return None if isinstance(self.defense, BuiltIn) else self.defense

    @own_defense.setter
    def own_defense(self, defense: Defense) -> None:
        self.defense = defense

    def __getstate__(self) -> dict[str, Any]:
        names = ("scenario", "defense", "horizon", "num_worlds", "threads")
        with self.use:
            state = {name: getattr(self, name) for name in names}
            return state | {"rows": self.rows.copy(), "unfinished": self.use.unfinished}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.use = ExclusiveUse()
        self.use.unfinished = state["unfinished"]
        self.__dict__.update({name: value for name, value in state.items() if name not in ("rows", "unfinished")})
        self._allocate()
        self.rows[...] = state["rows"]

    # --- running ---

    def start(self, worlds: np.ndarray) -> None:
        """Begin an episode in the worlds where `worlds` (bool[W]) is set; their seed, world_id and episode
        must be in place.
        """
        self.use.unfinished = True
        self.arrays.active[...] = worlds
        self.run(frame.BEGIN)
        self.arrays.active[...] = 1
        self.arrays.metrics[worlds] = 0.0
        if not isinstance(self.defense, BuiltIn):
            n = self.parameters.lengths
            call(self.defense, "reset", Shape(self.num_worlds, n["K"], n["J"], n["D"]), worlds)

    def step(self, actions: np.ndarray) -> None:
        """One frame of all worlds on checked actions[W, K, A]."""
        self._action[...] = actions
        self.run_frame(frame.EDIT_AND_TRACK, frame.NEXT_FRAME)

    def sense(self) -> None:
        """Sense the present frame once more, after targets or seeds have been changed."""
        self.use.unfinished = True
        self.run(frame.SENSE_ONLY)

    def run_frame(self, before: int, after: int) -> None:
        """Stages before judging, the defense, stages after it: one call of the engine, or two around a user's
        own defense.
        """
        self.use.unfinished = True
        if isinstance(self.defense, BuiltIn):
            self.run(before | frame.JUDGE_BUILT_IN | frame.CONCLUDE | after)
            return
        self.run(before | frame.JUDGE_NOTHING)
        evidence = self.evidence()
        verdict = call(self.defense, "update", evidence)
        if not self.use.unfinished:
            raise RuntimeError(f"{source_of(self.defense)}.update has called reset() of the environment that called it")
        apply_verdict(self.defense, verdict, evidence, self.arrays)
        self.run(frame.CONCLUDE | after)

    def evidence(self) -> Evidence:
        """The present frame's evidence; live views, so copy what must outlast the frame."""
        if self._evidence is None:
            fovs = Fovs.of(self.scenario, np.arange(self.scenario.n_agents))
            self._evidence = Evidence.of(self.arrays, TrackerBelief.of(self.parameters.__getitem__), fovs)
        return self._evidence

    def metrics(self) -> dict[str, np.ndarray]:
        """The frame's metrics by name, each `[W]`."""
        return dict(zip(FRAME_METRICS, self.arrays.metrics.copy().T, strict=True))

    def head(self) -> np.ndarray:
        """A copy of what every step hands out, a record `HEAD` for every world."""
        return self.rows[:, : self._head.itemsize].copy().view(self._head)[:, 0]

    def close(self) -> None:
        self.use.check_free()
        self._workers.close()


class Face:
    """What the faces of a batch share."""

    worlds: Batch

    @property
    def arrays(self) -> Arrays:
        """Live views of everything in the worlds, with leading axis W."""
        return self.worlds.arrays

    @property
    def observation_table(self) -> ObservationTable:
        """Names, slices, shapes and units of the observation's fields."""
        return self.worlds.parameters.observation

    @property
    def action_table(self) -> ActionTable:
        """Where injections and suppressions stand in an action."""
        return self.worlds.parameters.actions
