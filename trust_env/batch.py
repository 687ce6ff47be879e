"""A batch of worlds: buffers, threads, seeds. What the faces (PettingZoo, arrays, fusion centre) are thin
layers over.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from trust_env import frame as engine
from trust_env.compiled.threads import Crew
from trust_env.defenses import BuiltIn, Defense, Evidence, Shape, Verdict, build_defense, fits_publication
from trust_env.parameters import Pack
from trust_env.scenario import Scenario, load_scenario
from trust_env.world.fields import METRICS, ROW, aligned_zeros
from trust_env.world.tracking.score import CONFIRMED

SEED_LIMIT = 2**63


def checked_seed(seed: Any) -> int:
    """A seed as int; fresh entropy for None. ValueError for anything but an integer from 0 to 2^63 - 1."""
    if seed is None:
        return int.from_bytes(os.urandom(8), "little") % SEED_LIMIT
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or not 0 <= seed < SEED_LIMIT:
        raise ValueError(f"seed must be an integer from 0 to 2^63 - 1, or None; got {seed!r}")
    return int(seed)


class Arrays(Mapping[str, np.ndarray]):
    """Live views of the worlds' memory by name, with leading axis W; writing to them changes the worlds."""

    def __init__(self, pack: Pack, rows: np.ndarray):
        self._views = {
            name: pack.layout.view(rows, name) for name, kind in pack.layout.kinds.items() if kind[0] == ROW
        }

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


class Worlds:
    """W worlds of one scenario under one defense.

    threads: how many threads share a frame's work (default: the processors this process may use).
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
        self.horizon = self.scenario.horizon if horizon is None else _positive("max_cycles", horizon)
        self.num_worlds = _positive("num_worlds", num_worlds)
        available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        self.threads = _positive("threads", threads or available)
        self._allocate()

    def _allocate(self) -> None:
        self.pack = Pack(self.scenario, self.defense, self.horizon)
        layout = self.pack.layout
        self._head = layout.head
        self.rows = aligned_zeros(self.num_worlds, layout.row_bytes)
        self.arrays = Arrays(self.pack, self.rows)
        self.crew = Crew(self.pack, self.rows, self.threads)
        self.arrays.dt[...] = self.scenario.dt
        self.arrays.active[...] = 1
        self._evidence: Evidence | None = None

    @property
    def roles(self) -> np.ndarray:
        """+1 adversary, -1 benign, int[K]."""
        return self.pack.layout.view(self.pack.params, "role")

    # --- copies and snapshots ---

    @property
    def own_defense(self) -> Defense | None:
        """A user's own defense, which keeps its memory outside the worlds'; None for a built-in one."""
        return None if isinstance(self.defense, BuiltIn) else self.defense

    @own_defense.setter
    def own_defense(self, defense: Defense) -> None:
        self.defense = defense

    def __getstate__(self) -> dict[str, Any]:
        return {
            "scenario": self.scenario,
            "defense": self.defense,
            "horizon": self.horizon,
            "num_worlds": self.num_worlds,
            "threads": self.threads,
            "rows": self.rows.copy(),
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update({name: value for name, value in state.items() if name != "rows"})
        self._allocate()
        self.rows[...] = state["rows"]

    # --- running ---

    def run(self, stages: int) -> None:
        """Run stages of a frame in all active worlds."""
        self.crew.run(stages)

    def start(self, worlds: np.ndarray) -> None:
        """Begin an episode in the worlds where `worlds` (bool[W]) is set; their seed, world_id and episode
        must be in place.
        """
        self.arrays.active[...] = worlds
        self.run(engine.RESET)
        self.arrays.active[...] = 1
        if not isinstance(self.defense, BuiltIn):
            dims = self.pack.dims
            self.defense.reset(Shape(self.num_worlds, dims["K"], dims["J"], dims["D"]), worlds)

    def step(self) -> None:
        """One frame of all worlds, on the actions in `arrays.action`."""
        self.run_frame(engine.EDIT_AND_TRACK, engine.NEXT)

    def run_frame(self, before: int, after: int) -> None:
        """Stages before judging, the defense, stages after it: one kernel call, or two around a user's own
        defense.
        """
        if isinstance(self.defense, BuiltIn):
            self.run(before | engine.JUDGE | engine.CONCLUDE | after)
            return
        self.run(before | engine.JUDGE)  # clears the verdict
        self._apply(self.defense.update(self.evidence()))
        self.run(engine.CONCLUDE | after)

    def evidence(self) -> Evidence:
        """The present frame's evidence; live views, so copy what must outlast the frame."""
        if self._evidence is None:
            a = self.arrays
            self._evidence = Evidence(
                a.track_id, a.track_status, a.track_age, a.track_score, a.track_doomed, a.track_mean,
                a.track_cov, a.expected, a.detected, a.held, a.reports, a.report_count, a.assignment,
                a.innovation, a.innovation_cov, a.distance2, a.agent_score, a.pose,
                a.frame.reshape(-1), a.dt.reshape(-1),
            )  # fmt: skip
        return self._evidence

    def _apply(self, verdict: Verdict) -> None:
        """Write a user's verdict into the worlds, checked."""
        if not isinstance(verdict, Verdict):
            raise TypeError(
                f"{type(self.defense).__name__}.update must return a trust_env.Verdict, "
                f"not {type(verdict).__name__}"
            )
        a, dims = self.arrays, self.pack.dims
        tracks, agents = (self.num_worlds, dims["J"]), (self.num_worlds, dims["K"])
        for name, shape in (
            ("track_trust", tracks),
            ("track_trust_var", tracks),
            ("agent_trust", agents),
            ("agent_trust_var", agents),
        ):
            if getattr(verdict, name) is not None:
                a[name][...] = self._checked(name, getattr(verdict, name), shape, unit=True)
        if verdict.keep is not None:
            a.keep[...] = self._checked("keep", verdict.keep, tracks).astype(bool)
        kept = self.evidence().confirmed | ((self.evidence().status == CONFIRMED) & a.keep)
        publish = (
            fits_publication(kept, a.track_trust)
            if verdict.publish is None
            else self._checked("publish", verdict.publish, tracks)
        )
        a.publish[...] = publish.astype(bool) & kept
        weight = (
            np.where(np.isnan(a.agent_trust), 1.0, a.agent_trust)
            if verdict.agent_weight is None
            else verdict.agent_weight
        )
        a.agent_weight[...] = np.nan_to_num(self._checked("agent_weight", weight, agents, unit=True), nan=1.0)

    def _checked(self, name: str, value: Any, shape: tuple[int, ...], unit: bool = False) -> np.ndarray:
        what = f"{type(self.defense).__name__}: {name}"
        try:
            array = np.asarray(value)
        except ValueError as error:
            raise ValueError(f"{what} must be an array of shape {list(shape)}: {error}") from None
        if array.shape != shape:
            axes = "agents" if name.startswith("agent") else "tracks"
            raise ValueError(
                f"{what} must have shape {list(shape)} (worlds, {axes}), not {list(array.shape)}"
            )
        if array.dtype.kind not in "fiub":
            raise ValueError(f"{what} must hold numbers or truth values, not {array.dtype}")
        fits = np.isnan(array) | ((array >= 0.0) & (array <= 1.0))
        if unit and not fits.all():
            raise ValueError(f"{what} must lie in [0, 1] (NaN: no opinion); found {array[~fits][0]}")
        return array

    def metrics(self) -> dict[str, np.ndarray]:
        """The frame's metrics by name, each `[W]`."""
        return by_name(self.arrays.metrics.copy())

    def head(self) -> np.ndarray:
        """A copy of what every step hands out, a record `HEAD` for every world."""
        return self.rows[:, : self._head.itemsize].copy().view(self._head)[:, 0]

    def close(self) -> None:
        self.crew.close()


def by_name(metrics: np.ndarray) -> dict[str, np.ndarray]:
    """Metrics `[W, ·]` in the order of `METRICS` as a dictionary of `[W]`."""
    return dict(zip(METRICS, metrics.T, strict=True))


def _positive(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise ValueError(f"{name} must be a whole number of at least 1; got {value!r}")
    return int(value)
