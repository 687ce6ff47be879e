"""What ours is compared with: mpe2, and the plain NumPy reference; see also `stone_soup`."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import numpy as np

from trust_env.training.speed.missing import MissingPeer, require
from trust_env.training.speed.stopwatch import Run
from trust_env.training.speed.subjects import RecordedEpisode

ORACLE = Path(__file__).resolve().parents[2] / "tests" / "oracle.py"


def mpe2_subject() -> Run:
    """Steps of mpe2's simple_spread_v3 with three agents, resets included: what users of PettingZoo know."""
    require("mpe2", "the extra `bench`")
    from mpe2 import simple_spread_v3

    env: Any = simple_spread_v3.parallel_env(N=3)
    drawn = np.random.default_rng(0).integers(0, 5, (32, 3)).tolist()
    actions = [dict(zip(env.possible_agents, frame, strict=True)) for frame in drawn]
    env.reset(seed=0)

    def run(frames: int) -> None:
        for frame in range(frames):
            if not env.agents:
                env.reset()
            env.step(actions[frame % len(actions)])

    return run


def oracle_subject(recorded: RecordedEpisode) -> Run:
    """The plain NumPy reference of the centre, frame by frame; it is in the repository's tests."""
    oracle = _load_oracle()
    s = recorded.scenario
    agents = [s.agent(k) for k in range(s.n_agents)]
    tracker, belief = s.tracker, agents[0].belief
    params = oracle.TrackerParams(
        p_detect=belief.p_detect, beta_fp=belief.beta_fp, beta_nt=belief.beta_nt, gate=tracker.gate,
        process_noise=tracker.process_noise, initial_velocity_variance=tracker.initial_velocity_variance,
        alpha=tracker.alpha, beta=tracker.beta, confirmed_drop=tracker.confirmed_drop,
        tentative_drop=tracker.tentative_drop, max_unseen=tracker.max_unseen, capacity=tracker.max_tracks,
    )  # fmt: skip
    capacity, hold_distance = tracker.max_local_tracks, s.evidence.hold_distance
    contains = [oracle.circle(pose[:2], a.fov.radius) for a, pose in zip(agents, recorded.poses, strict=True)]
    noise = [(a.sensor.sigma or 1.0) ** 2 * np.eye(2) for a in agents]
    detections = [recorded.detections(frame) for frame in range(len(recorded.reports))]

    def new_centre() -> Any:
        trust = oracle.OracleTrust("paper", n_agents=s.n_agents)
        return oracle.OracleCentre(params, trust, hold_distance=hold_distance, local_capacity=capacity)

    def run(frames: int) -> None:
        centre = new_centre()
        for step in range(frames):
            frame = step % len(detections)
            if frame == 0:
                centre = new_centre()
            centre.update(detections[frame], contains, noise, s.dt)

    return run


def _load_oracle() -> Any:
    """The module tests/oracle.py. MissingPeer: this is not a checkout of the repository."""
    if not ORACLE.is_file():
        raise MissingPeer("a checkout of the repository, for the reference in its tests/oracle.py")
    spec = importlib.util.spec_from_file_location("trust_env_oracle", ORACLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # its dataclasses look it up
    spec.loader.exec_module(module)
    return module
