"""What is kept of an episode that is played again: all that a picture of any of its frames shows, and its metrics."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from trust_env.agents import Player
from trust_env.defenses import build_defense
from trust_env.metrics import METRICS, EpisodeMetrics
from trust_env.parallel import TrustEnv
from trust_env.render.scene import DetectionKind, Scene, TrackKind, read_scene
from trust_env.training.pages.packing import pack
from trust_env.training.replays.episode import Episode

DETECTION_KINDS: tuple[DetectionKind, ...] = ("honest", "clutter", "injected")
TRACK_KINDS: tuple[TrackKind, ...] = ("tentative", "hidden", "published")
EXPECTED, DETECTED, HIT, HELD = 1, 2, 4, 8  # bits of an agent's evidence on a track
_EVIDENCE = (("expected", EXPECTED), ("detected", DETECTED), ("hit", HIT), ("held", HELD))


@dataclass(frozen=True)
class Recording:
    """An episode's scenes, frame by frame, what the agents say of the tracks in them, and the metrics of all.

    scenes[t]: the scene of frame t + 1; evidence[t]: uint8[tracks, K], bits; scores[t]: float[tracks], nats;
    targets[t]: int[targets], which they are; metrics: by name, NaN where undefined.
    """

    episode: Episode
    scenes: list[Scene]
    evidence: list[np.ndarray]
    scores: list[np.ndarray]
    targets: list[np.ndarray]
    metrics: dict[str, float]

    def summary(self) -> dict[str, Any]:
        """Plain values only: which episode it is, who plays, and the metrics, None where undefined."""
        episode, metrics = self.episode, self.metrics
        return {
            "scenario": episode.scenario.name,
            "attack": episode.attack,
            "defense": episode.defense,
            "seed": episode.seed,
            "world": episode.world,
            "metrics": {name: None if np.isnan(value) else value for name, value in metrics.items()},
        }

    def to_dict(self) -> dict[str, Any]:
        """The summary, what stays the same, and every frame, packed."""
        first = self.scenes[0]
        return {
            **self.summary(),
            "frames": len(self.scenes),
            "dt": first.dt,
            "accuse_below": first.accuse_below,
            "extent": list(first.extent),
            "agents": [
                {"name": a.name, "adversary": a.adversary, "at": a.position.tolist(), "outline": a.outline.tolist()}
                for a in first.agents
            ],
            "packed": pack(self._arrays()),
        }

    def _arrays(self) -> dict[str, np.ndarray]:
        """Every frame's agents, targets, detections and tracks, one after the other; `…_end[t]`: where t's end."""
        scenes = self.scenes
        targets, detections, tracks = (
            [getattr(scene, name) for scene in scenes] for name in ("targets", "detections", "tracks")
        )
        return {
            **{name: np.array([s.metrics[name] for s in scenes]).round().astype(np.uint32) for name in _COUNTS},
            "gospa": np.array([scene.metrics["gospa"] for scene in scenes]),
            "agent_trust": np.array([[agent.trust for agent in scene.agents] for scene in scenes]),
            "agent_std": np.array([[agent.trust_std for agent in scene.agents] for scene in scenes]),
            "target_end": _ends(targets),
            "target": np.concatenate(self.targets),
            "target_at": _points(targets, lambda target: target.position),
            "target_visible": _column(targets, lambda target: target.visible, bool),
            "target_shown": _column(targets, lambda target: target.shown, bool),
            "detection_end": _ends(detections),
            "detection_agent": _column(detections, lambda detection: detection.agent, int),
            "detection_kind": _column(detections, lambda detection: DETECTION_KINDS.index(detection.kind), int),
            "detection_at": _points(detections, lambda detection: detection.position),
            "track_end": _ends(tracks),
            "track": _column(tracks, lambda track: track.id, int),
            "track_kind": _column(tracks, lambda track: TRACK_KINDS.index(track.kind), int),
            "track_false": _column(tracks, lambda track: track.false, bool),
            "track_at": _points(tracks, lambda track: track.position),
            "track_velocity": _points(tracks, lambda track: track.velocity),
            "track_ellipse": _ellipses([track.cov for of_frame in tracks for track in of_frame]),
            "track_trust": _column(tracks, lambda track: track.trust, float),
            "track_std": _column(tracks, lambda track: track.trust_std, float),
            "track_score": np.concatenate(self.scores),
            "evidence": np.concatenate([bits.ravel() for bits in self.evidence]),
        }


_COUNTS = ("false_tracks", "injected_tracks", "missing_targets", "visible_targets", "published_tracks")


def _ends(frames: list[list[Any]]) -> np.ndarray:
    return np.cumsum([len(found) for found in frames])


def _column(frames: list[list[Any]], value: Callable[[Any], Any], kind: type) -> np.ndarray:
    return np.array([value(found) for of_frame in frames for found in of_frame], dtype=kind)


def _points(frames: list[list[Any]], value: Callable[[Any], np.ndarray]) -> np.ndarray:
    return np.array([value(found) for of_frame in frames for found in of_frame], dtype=float)


def _ellipses(covs: list[np.ndarray]) -> np.ndarray:
    """Standard deviations along the two axes (m), and the direction of the first (rad), [n, 3]."""
    if not covs:
        return np.empty((0, 3))
    values, axes = np.linalg.eigh(np.stack(covs))
    angle = np.arctan2(axes[:, 1, 1], axes[:, 0, 1])
    deviations = np.sqrt(np.maximum(values, 0.0))
    return np.stack([deviations[:, 1], deviations[:, 0], angle], axis=1)


def record(episode: Episode) -> Recording:
    """Play an episode again and keep what it shows. ValueError: its metrics are not those of its row, to the bit."""
    env = TrustEnv(episode.scenario, build_defense(episode.judge), max_cycles=episode.frames)
    try:
        metrics, scenes, evidence, scores, targets = EpisodeMetrics(env), [], [], [], []
        for _ in frames_of(env, episode):
            metrics.update()
            arrays, scene = env.arrays, read_scene(env.worlds)
            columns = np.flatnonzero(arrays.track_status[0])
            scenes.append(scene)
            evidence.append(sum(arrays[name][0][:, columns].T * np.uint8(bit) for name, bit in _EVIDENCE))
            scores.append(arrays.track_score[0, columns])
            targets.append(np.flatnonzero(arrays.scored_alive[0]))
        found = {name: float(values[0]) for name, values in metrics.result().items()}
    finally:
        env.close()
    _require_metrics(episode, found)
    return Recording(episode, scenes, evidence, scores, targets, found)


def frames_of(env: TrustEnv, episode: Episode) -> Iterator[int]:
    """Play an episode in an environment of its scenario and defense, and stop after each frame, counted from 1."""
    player = Player(env, {"adversary": episode.policy})
    observations, _ = env.reset(seed=episode.seed, options={"world": episode.world, "episode": 0})
    for frame in range(1, episode.frames + 1):
        observations = env.step(player.actions(observations))[0]
        yield frame


def _require_metrics(episode: Episode, found: dict[str, float]) -> None:
    for name in METRICS if episode.metrics else ():
        expected, value = episode.metrics[name], found[name]
        if value != expected and not (expected is None and np.isnan(value)):
            place = f"{episode.attack} x {episode.defense}, world {episode.world}"
            raise ValueError(f"{place}: {name} is {value!r} here; expected {expected!r}, as in its row")
