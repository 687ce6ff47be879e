"""The eight trust panels (paper, Sec. V): two cases, two priors, tracks and agents, in our environment with our tracker."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from agents import Player
from training.paper.published import (
    N_AGENTS,
    TRUSTED,
    Panel,
    PanelKey,
    evidence,
    final_beliefs,
    objects,
    panel_keys,
)
from trust_env.core.score import CONFIRMED
from trust_env.fusion import replay_evidence
from trust_env.vector import VectorEnv

PRESETS = ("cdc2024", "paper")


def simulated_panels(
    preset: str, seeds: int, advance: Callable[[int], Any] = lambda _: None
) -> dict[PanelKey, Panel]:
    """Means over `seeds` worlds of every panel; `advance(1)` is called after every one."""
    panels = {}
    for key in panel_keys():
        panels[key] = simulated_panel(key, preset, seeds)
        advance(1)
    return panels


def simulated_panel(key: PanelKey, preset: str, seeds: int) -> Panel:
    """One case, one prior, with the preset's own strong prior on the trusted agent."""
    case, trusted = key
    venv = VectorEnv(case, _defense(preset, trusted), seeds, autoreset=False)
    player = Player(venv, {"adversary": "false_positive"})
    places = np.array([thing.position for thing in objects(case)])
    tracks, agents = [], []
    observations, _ = venv.reset(seed=0)
    for _ in range(venv.max_cycles):
        observations, *_ = venv.step(player.actions(observations))
        tracks.append(_trust_at(venv, places))
        agents.append(venv.arrays.agent_trust.mean(axis=0))
    venv.close()
    return Panel(np.stack(tracks, axis=1), np.stack(agents, axis=1))


def _defense(preset: str, trusted: bool) -> str:
    return f"trust(preset={preset}, trusted=[{TRUSTED}])" if trusted else f"trust(preset={preset})"


def _trust_at(venv: VectorEnv, places: np.ndarray) -> np.ndarray:
    """Mean over the worlds of the trust in the confirmed track nearest to every place; NaN where no world has one."""
    a = venv.arrays
    distance = np.linalg.norm(
        a.track_mean[:, None, :, :2] - places[None, :, None], axis=-1
    )  # [W, J, columns]
    distance[np.broadcast_to((a.track_status != CONFIRMED)[:, None], distance.shape)] = np.inf
    nearest = distance.argmin(axis=2)
    trust = np.take_along_axis(a.track_trust, nearest, axis=1)
    trust[distance.min(axis=2) > venv.scenario.metrics.match_distance] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # no world has such a track yet
        return np.nanmean(trust, axis=0)


def estimator_deviation(preset: str) -> float:
    """Fed with the authors' own evidence: the largest difference of any final α or β from theirs."""
    return max(
        float(np.abs(replayed_beliefs(key, preset) - final_beliefs(key)).max()) for key in panel_keys()
    )


def replayed_beliefs(key: PanelKey, preset: str) -> np.ndarray:
    """α and β of tracks and then agents after the last frame of the authors' evidence, [J + K, 2]."""
    last = replay_evidence(evidence(key), N_AGENTS, _defense(preset, key[1]))[-1]
    return np.array([*(last.track_beliefs[i] for i in sorted(last.track_beliefs)), *last.agent_beliefs])
