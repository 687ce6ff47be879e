"""The fusion centre without the simulator: on recorded or live detections, or on recorded evidence alone.

Both run the very kernels that the environment runs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import expit

from trust_env import frame as stages
from trust_env.batch import Batch
from trust_env.defenses import build_defense, refuse_reference
from trust_env.defenses.trust import Trust
from trust_env.world.origin import CLUTTER
from trust_env.world.tracking.score import CONFIRMED


class _ByName:
    """Fields can be read as attributes or as keys."""

    def __getitem__(self, name: str) -> Any:
        return getattr(self, name)


@dataclass(frozen=True)
class FusedFrame(_ByName):
    """What the centre holds after an update. Rows are tracks, in order of their ids.

    track_id int[n]; tracks[n, 4] and covariances[n, 4, 4] (m, m/s); status int[n] (1 tentative, 2 confirmed);
    scores[n] (nats); existence[n], probabilities; trust[n] and agent_trust[K], means in [0, 1], NaN = no
    opinion; expected, detected, held: bool[K, n]; picture[m, 4] and picture_id int[m]: the tracks that the
    centre publishes.
    """

    time: float
    track_id: np.ndarray
    tracks: np.ndarray
    covariances: np.ndarray
    status: np.ndarray
    scores: np.ndarray
    existence: np.ndarray
    trust: np.ndarray
    agent_trust: np.ndarray
    expected: np.ndarray
    detected: np.ndarray
    held: np.ndarray
    picture: np.ndarray
    picture_id: np.ndarray


class FusionCentre:
    """The tracker and a defense, fed with detections.

    scenario: gives the agents, their FOVs and what the tracker believes; its targets play no part. defense:
    as in `parallel_env`; ValueError for one that is for evaluation only.
    """

    def __init__(self, scenario: Any = "patrol", defense: Any = "trust"):
        judge = build_defense(defense)
        refuse_reference(judge, "the fusion centre")
        self._worlds = Batch(scenario, judge, 1, threads=1)
        self.scenario, self.n_agents = self._worlds.scenario, self._worlds.scenario.n_agents
        self.reset()

    def reset(self) -> None:
        """Forget all tracks and beliefs."""
        drawn = [k for k in range(self.n_agents) if self.scenario.agent(k).position is None]
        with self._worlds.use:
            self._worlds.arrays.seed[...], self._worlds.arrays.dt[...] = 0, self.scenario.dt
            self._worlds.start(np.ones(1, dtype=bool))
            self._time: float | None = None
            self._pose_missing = f"agents {drawn} have no position in scenario {self.scenario.name!r}" if drawn else ""
            self._worlds.use.unfinished = False

    def update(self, detections: Sequence[Any], time: float | None = None, poses: Any = None) -> FusedFrame:
        """One frame: detections, an array [n_k, 2] (m) per agent; time in s (default: `dt` after the last);
        poses[K, 3] (x, y in m, heading in rad; default: as before). Of detections of an agent that are nearer than
        its `sensor.resolution` the first one counts.

        Raises ValueError, and changes nothing, when a shape is wrong, a number is not finite, an agent has
        more detections than `sensor.max_detections`, or time does not increase. RuntimeError from a second
        thread, and after an update that broke off (an interrupt, an error in a user's own defense).
        """
        with self._worlds.use:
            self._worlds.use.check_finished()
            fused = self._update(detections, time, poses)
            self._worlds.use.unfinished = False
            return fused

    def _update(self, detections: Sequence[Any], time: float | None, poses: Any) -> FusedFrame:
        reports = self._checked_reports(detections)
        now = self._checked_time(time)
        placed = None if poses is None else self._checked_poses(poses)
        if placed is None and self._pose_missing:
            raise ValueError(
                f"poses are needed: {self._pose_missing}; expected an array [{self.n_agents}, 3] of x, y, heading"
            )
        arrays = self._worlds.arrays
        self._worlds.use.unfinished = True
        if placed is not None:
            arrays.pose[0], self._pose_missing = placed, ""
        for k, points in enumerate(reports):
            arrays.report_count[0, k] = len(points)
            arrays.report_detections[0, k, : len(points)], arrays.report_origin[0, k] = points, CLUTTER
        if self._time is not None:
            arrays.dt[...] = now - self._time
        self._time = now
        self._worlds.run_frame(stages.TRACK_AS_REPORTED, 0)
        arrays.frame[...] += 1
        return self._frame(now)

    def _frame(self, now: float) -> FusedFrame:
        a = self._worlds.arrays
        columns = np.flatnonzero(a.track_status[0])
        columns = columns[np.argsort(a.track_id[0, columns])]
        shown = columns[a.published[0, columns]]
        evidence = {name: a[name][0][:, columns].copy() for name in ("expected", "detected", "held")}
        return FusedFrame(
            time=now,
            track_id=a.track_id[0, columns],
            tracks=a.track_mean[0, columns],
            covariances=a.track_cov[0, columns],
            status=a.track_status[0, columns],
            scores=a.track_score[0, columns],
            existence=expit(a.track_score[0, columns]),
            trust=a.track_trust[0, columns],
            agent_trust=a.agent_trust[0].copy(),
            picture=a.track_mean[0, shown],
            picture_id=a.track_id[0, shown],
            **evidence,
        )

    def _checked_reports(self, detections: Sequence[Any]) -> list[np.ndarray]:
        if len(detections) != self.n_agents:
            raise ValueError(f"expected one array of detections per agent ({self.n_agents}), got {len(detections)}")
        limit, out = self.scenario.sensor.max_detections, []
        for k, given in enumerate(detections):
            points = np.asarray(given, dtype=np.float64)
            points = points.reshape(0, 2) if points.size == 0 else points
            if points.ndim != 2 or points.shape[1] != 2:
                raise ValueError(
                    f"the detections of agent {k} must have shape [n, 2] (x, y in m), not {list(points.shape)}"
                )
            if not np.isfinite(points).all():
                raise ValueError(
                    f"the detections of agent {k} must be finite; row {np.argwhere(~np.isfinite(points))[0][0]} is not"
                )
            if len(points) > limit:
                raise ValueError(
                    f"agent {k} reports {len(points)} detections; "
                    f"sensor.max_detections of scenario {self.scenario.name!r} is {limit}"
                )
            out.append(points)
        return out

    def _checked_time(self, time: float | None) -> float:
        if time is None:
            return 0.0 if self._time is None else self._time + self.scenario.dt
        if not np.isfinite(time) or (self._time is not None and time <= self._time):
            raise ValueError(f"time must be finite and later than that of the last update ({self._time} s); got {time}")
        return float(time)

    def _checked_poses(self, poses: Any) -> np.ndarray:
        array = np.asarray(poses, dtype=np.float64)
        if array.shape != (self.n_agents, 3) or not np.isfinite(array).all():
            raise ValueError(
                f"poses must be finite and of shape [{self.n_agents}, 3] (x, y in m, heading in rad); "
                f"got shape {list(array.shape)}"
            )
        return array


@dataclass(frozen=True)
class ReplayedFrame(_ByName):
    """The verdict on one frame of evidence; tracks in the order in which the frame listed them.

    track_trust[J], track_trust_var[J], publish bool[J], agent_trust[K], agent_trust_var[K]; for defenses with
    Beta beliefs also track_beliefs {id: (α, β)} and agent_beliefs [(α, β), ...], else empty.
    """

    track_id: np.ndarray
    track_trust: np.ndarray
    track_trust_var: np.ndarray
    publish: np.ndarray
    agent_trust: np.ndarray
    agent_trust_var: np.ndarray
    track_beliefs: dict[int, tuple[float, float]]
    agent_beliefs: list[tuple[float, float]]


def replay_evidence(
    frames: Iterable[Mapping[str, Any]],
    n_agents: int,
    defense: Any = "trust",
    agent_priors: Mapping[int, tuple[float, float]] | None = None,
    dt: float = 1.0,
) -> list[ReplayedFrame]:
    """Judge recorded evidence, frame by frame.

    frames: mappings with track_id int[J] (confirmed tracks; a track keeps its id) and expected, detected,
    held: bool[K, J]. A defense that looks at more than that (`mate` weighs by distance and age) finds each
    track at distance 0 and old unless the frame gives track_mean[J, 4], poses[K, 3] and hits int[J]; an agent
    hit what it detected unless the frame gives hit bool[K, J]; innovations are NaN, and no cell is covered.
    agent_priors: {agent: (mean, precision)}, for `trust`. dt: s between frames. Raises ValueError for arrays
    of wrong shape, ids that are repeated within a frame, and a defense that is for evaluation only.
    """
    listed = [_checked_frame(f, frame, n_agents) for f, frame in enumerate(frames)]
    judge = build_defense(defense)
    refuse_reference(judge, "recorded evidence")
    if agent_priors:
        if not isinstance(judge, Trust):
            raise ValueError(f"agent_priors are for the defense `trust`, not {type(judge).__name__}")
        params: dict[str, Any] = {**judge.params(), "agent_priors": dict(agent_priors)}
        judge = Trust(**params)
    most = max((len(frame["track_id"]) for frame in listed), default=1)
    team = {"n_adversaries": 0, "n_benign": n_agents, "placement": "together"}
    worlds = Batch({"dt": dt, "team": team, "tracker": {"max_tracks": max(1, 2 * most)}}, judge, 1, threads=1)
    worlds.start(np.ones(1, dtype=bool))
    return [_judge_frame(worlds, frame) for frame in listed]


def _checked_frame(f: int, frame: Mapping[str, Any], n_agents: int) -> dict[str, np.ndarray]:
    missing = [name for name in ("track_id", "expected", "detected", "held") if name not in frame]
    if missing:
        raise ValueError(f"frame {f} lacks {', '.join(missing)}")
    out = {name: np.asarray(value) for name, value in frame.items()}
    out["track_id"] = out["track_id"].reshape(-1).astype(np.int64)
    tracks = len(out["track_id"])
    if len(np.unique(out["track_id"])) != tracks or (tracks and out["track_id"].min() < 0):
        raise ValueError(f"frame {f}: track ids must be different and not negative; got {out['track_id'].tolist()}")
    for name in ("expected", "detected", "held"):
        out[name] = out[name].reshape(n_agents, 0) if tracks == 0 and out[name].size == 0 else out[name]
        if out[name].shape != (n_agents, tracks):
            raise ValueError(
                f"frame {f}: {name} must have shape [{n_agents}, {tracks}] (agents, tracks), "
                f"not {list(out[name].shape)}"
            )
    return out


def _judge_frame(worlds: Batch, frame: Mapping[str, np.ndarray]) -> ReplayedFrame:
    """Lay the frame's tracks into the columns that they had before, new ones into free columns, and judge."""
    a, ids = worlds.arrays, frame["track_id"]
    stale = ~np.isin(a.track_id[0], ids)
    a.track_id[0, stale], a.track_status[0, stale] = -1, 0
    known = {int(i): j for j, i in enumerate(a.track_id[0]) if i >= 0}
    free = (j for j in range(a.track_id.shape[1]) if a.track_id[0, j] < 0)
    columns = np.array([known[i] if i in known else next(free) for i in ids.tolist()], dtype=np.int64)
    a.track_id[0, columns], a.track_status[0, columns], a.track_to_delete[...] = ids, CONFIRMED, False
    a.track_age[0, columns] += 1
    a.track_count[...] = columns.max(initial=-1) + 1
    for name in ("expected", "detected", "hit", "held"):
        a[name][...] = False
        a[name][0][:, columns] = frame.get(name, frame["detected"]).astype(bool)
    a.inside[...], a.innovation[...], a.innovation_cov[...], a.distance2[...] = a.expected, np.nan, np.nan, np.nan
    a.pose[0] = frame.get("poses", np.zeros_like(a.pose[0]))
    a.track_mean[0, columns] = frame.get("track_mean", np.zeros((len(ids), 4)))
    a.track_hits[0, columns] = frame.get("hits", np.full(len(ids), 1000))
    worlds.run_frame(0, 0)
    a.frame[...] += 1
    beliefs = isinstance(worlds.defense, Trust)
    pairs = a.trust_track_belief[0, columns].tolist() if beliefs else []
    return ReplayedFrame(
        ids, a.track_trust[0, columns], a.track_trust_var[0, columns], a.publish[0, columns],
        a.agent_trust[0].copy(), a.agent_trust_var[0].copy(),
        {i: (alpha, beta) for i, (alpha, beta) in zip(ids.tolist(), pairs, strict=False)},
        [(alpha, beta) for alpha, beta in a.trust_agent_belief[0].tolist()] if beliefs else [],
    )  # fmt: skip
