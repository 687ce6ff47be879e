"""The eight trust panels (paper, Sec. V): two cases, two priors, tracks and agents, in our environment."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from trust_env.agents import Player
from trust_env.fusion_centre import replay_evidence
from trust_env.training.paper.published import (
    N_AGENTS,
    SUPPRESSED,
    TRUSTED,
    Panel,
    PanelKey,
    evidence,
    final_beliefs,
    objects,
    panel_keys,
)
from trust_env.vector import VectorEnv
from trust_env.world.tracking.score import CONFIRMED

VARIANTS = {
    "cdc2024": "preset=cdc2024",
    "paper": "preset=paper",
    "mate": "preset=mate",
    "paper*": "preset=paper, agent_psms=least, strong_precision=100",
}
"""Estimators by name; paper*: the two switches that make the difference between `paper` and the figures."""


def simulated_panels(
    variant: str, seeds: int, keys: Iterable[PanelKey], advance: Callable[[int], Any] = lambda _: None
) -> dict[PanelKey, Panel]:
    """Means over `seeds` worlds of every panel; `advance(1)` is called after every one."""
    panels = {}
    for key in keys:
        panels[key] = simulated_panel(key, variant, seeds)
        advance(1)
    return panels


def simulated_panel(key: PanelKey, variant: str, seeds: int) -> Panel:
    """One case, without the prior or with the variant's own strong prior on the trusted agent.

    The adversaries replay what the case lists: injections, or suppressions.
    """
    case, trusted = key
    venv = VectorEnv(case, _defense(variant, trusted), seeds, autoreset=False)
    player = Player(venv, {"adversary": "suppress" if case.endswith(SUPPRESSED) else "false_positive"})
    places = np.array([obj.position for obj in objects(case)])
    tracks, agents = [], []
    observations, _ = venv.reset(seed=0)
    for _ in range(venv.max_cycles):
        observations, *_ = venv.step(player.actions(observations))
        tracks.append(_mean_at(venv, places, venv.arrays.track_trust[..., None])[:, 0])
        agents.append(venv.arrays.agent_trust.mean(axis=0))
    of_tracks = _mean_at(venv, places, venv.arrays.trust_track_belief)
    beliefs = np.concatenate([of_tracks, venv.arrays.trust_agent_belief.mean(axis=0)])
    venv.close()
    return Panel(np.stack(tracks, axis=1), np.stack(agents, axis=1), beliefs)


def _defense(variant: str, trusted: bool) -> str:
    prior = f", trusted=[{TRUSTED}]" if trusted else ""
    return f"trust({VARIANTS[variant]}{prior})"


def _mean_at(venv: VectorEnv, places: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values[W, J, n] of the confirmed track at every place [P], mean over the worlds that have one; NaN: none has."""
    a = venv.arrays
    distance = np.linalg.norm(a.track_mean[:, None, :, :2] - places[None, :, None], axis=-1)  # [W, J, columns]
    distance[np.broadcast_to((a.track_status != CONFIRMED)[:, None], distance.shape)] = np.inf
    found = np.take_along_axis(values, distance.argmin(axis=2)[..., None], axis=1)  # [W, P, n]
    found[distance.min(axis=2) > venv.scenario.metrics.match_distance] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of places where there is no track yet
        return np.nanmean(found, axis=0)


def estimator_deviation(variant: str) -> float:
    """The largest difference of any final α or β from the authors', given their own evidence."""
    differences = [np.abs(replayed_beliefs(key, variant) - final_beliefs(key)).max() for key in panel_keys()]
    return float(max(differences))


def replayed_beliefs(key: PanelKey, variant: str) -> np.ndarray:
    """α and β of tracks and then agents after the last frame of the authors' evidence, [J + K, 2]."""
    last = replay_evidence(evidence(key), N_AGENTS, _defense(variant, key[1]))[-1]
    return np.array([*(last.track_beliefs[i] for i in sorted(last.track_beliefs)), *last.agent_beliefs])
