"""Our own environments and fusion centre, to be timed.

Actions are drawn before the clock starts: every adversary keeps reporting false positives at places of its
own, in all its slots, as an attacker does; nobody suppresses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trust_env import frame as engine
from trust_env.batch import Batch
from trust_env.parallel import parallel_env
from trust_env.scenario import Scenario, load_scenario
from trust_env.training.speed.stopwatch import Run
from trust_env.vector import VectorEnv


def attack_actions(scenario: Scenario, shape: tuple[int, ...]) -> np.ndarray:
    """Actions float32[..., K, A] that inject at random places."""
    actions, slots = np.zeros(shape, dtype=np.float32), scenario.injection.slots
    rng = np.random.default_rng(0)
    for k, role in enumerate(scenario.roles):
        if role == "adversary":
            places = rng.uniform(-0.7, 0.7, (*shape[:-2], slots, 3))
            places[..., 0] = 1.0  # fire
            actions[..., k, : 3 * slots] = places.reshape(*shape[:-2], 3 * slots)
    return actions


def parallel_subject(scenario: str) -> Run:
    """Steps of one world behind the PettingZoo face, resets included."""
    env = parallel_env(scenario)
    size = env.action_space(env.possible_agents[0]).shape[0]
    drawn = attack_actions(env.scenario, (len(env.possible_agents), size))
    actions = dict(zip(env.possible_agents, drawn, strict=True))
    env.reset(seed=0)

    def run(frames: int) -> None:
        for _ in range(frames):
            if not env.agents:
                env.reset()
            env.step(actions)

    return run


def vector_subject(venv: VectorEnv, attacked: bool = True) -> Run:
    """Steps of a batch, its automatic resets included; a frame is a frame of one world. attacked: False: all honest."""
    shape = venv.arrays.action.shape
    actions = attack_actions(venv.scenario, shape) if attacked else np.zeros(shape, dtype=np.float32)
    venv.reset(seed=0)

    def run(frames: int) -> None:
        for _ in range(-(-frames // venv.num_worlds)):
            venv.step(actions)

    return run


@dataclass(frozen=True)
class RecordedEpisode:
    """An honest episode as the centre receives it: reports[T, K, D, 2] (m), counts[T, K], poses[K, 3]."""

    scenario: Scenario
    reports: np.ndarray
    counts: np.ndarray
    poses: np.ndarray

    def detections(self, frame: int) -> list[np.ndarray]:
        """One array [n_k, 2] per agent."""
        return [reports[:n] for reports, n in zip(self.reports[frame], self.counts[frame], strict=True)]


def record(scenario: str) -> RecordedEpisode:
    """The first episode of seed 0."""
    venv = VectorEnv(scenario, "score", 1, autoreset=False)
    venv.reset(seed=0)
    a, reports, counts = venv.arrays, [], []
    for _ in range(venv.max_cycles):
        venv.step(np.zeros(a.action.shape, dtype=np.float32))
        reports.append(a.report_detections[0].copy())
        counts.append(a.report_count[0].copy())
    return RecordedEpisode(load_scenario(scenario), np.stack(reports), np.stack(counts), a.pose[0].copy())


def centre_subject(recorded: RecordedEpisode) -> Run:
    """The fusion centre on recorded detections, a kernel call a frame: trackers, evidence, trust, picture."""
    worlds = Batch(recorded.scenario, "trust", 1, threads=1)
    a, every = worlds.arrays, np.ones(1, dtype=bool)
    reports, counts = a.report_detections[0], a.report_count[0]

    def run(frames: int) -> None:
        for step in range(frames):
            frame = step % len(recorded.reports)
            if frame == 0:
                worlds.start(every)
                a.pose[0] = recorded.poses
            reports[...], counts[...] = recorded.reports[frame], recorded.counts[frame]
            worlds.run_frame(engine.TRACK_AS_REPORTED, 0)
            a.frame[0] += 1

    return run
