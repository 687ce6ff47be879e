"""Copies of worlds: what a coalition can know is in them and nothing else, and the worlds stay as they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from trust_env.agents import Player
from trust_env.agents.copied_worlds import CopiedWorlds
from trust_env.spaces.action import ActionTable
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core
COALITION = np.array([0, 1])
W = 3


def played(scenario: Any = "patrol(knowledge=white_box)", defense: Any = "trust", frames: int = 15) -> VectorEnv:
    """Worlds after some frames of false positives."""
    env = VectorEnv(scenario, defense, W, autoreset=False)
    player = Player(env, {"adversary": "false_positive"})
    seen, _ = env.reset(3)
    for _ in range(frames):
        seen, *_ = env.step(player.actions(seen))
    return env


def imagined(env: VectorEnv) -> tuple[np.ndarray, np.ndarray]:
    """The central tracks as targets."""
    return env.arrays.track_mean.copy(), env.arrays.track_status == 2


def prepared(env: VectorEnv, targets: tuple[np.ndarray, np.ndarray] | None = None, sample: int = 0) -> CopiedWorlds:
    found = CopiedWorlds(env.worlds)
    found.prepare(COALITION, *(targets or imagined(env)), sample)
    return found


def test_copies_do_not_depend_on_what_the_coalition_cannot_know() -> None:
    """Other true targets, other detections and reports of others, other labels: the same copies, to the bit."""
    env = played()
    before = prepared(env)
    arrays, rng = env.arrays, np.random.default_rng(0)
    for name in ("target_state", "scored_state", "report_detections"):
        arrays[name][...] = rng.normal(0.0, 300.0, arrays[name].shape)
    for name in ("target_alive", "scored_alive", "track_injected", "scored_visible", "scored_missing"):
        arrays[name][...] = rng.random(arrays[name].shape) < 0.5
    for name in ("track_injected_hits", "track_label", "track_target", "report_count"):
        arrays[name][...] = rng.integers(0, 5, arrays[name].shape)
    arrays.raw_origin[...] = rng.integers(-1, 5, arrays.raw_origin.shape)
    arrays.raw_detections[:, 2:] = rng.normal(0.0, 300.0, arrays.raw_detections[:, 2:].shape)
    arrays.raw_count[:, 2:] = rng.integers(0, 16, arrays.raw_count[:, 2:].shape)
    assert np.array_equal(prepared(env).copies.rows, before.copies.rows)


@pytest.mark.parametrize("name", ["track_score", "track_mean", "agent_trust", "raw_detections", "pose", "frame"])
def test_copies_hold_what_the_centre_works_with_and_the_coalition_has_sensed(name: str) -> None:
    env = played()
    before = prepared(env).copies.rows
    env.arrays[name].reshape(W, -1)[:, 0] += 1
    assert not np.array_equal(prepared(env, imagined(env)).copies.rows, before)


def test_others_sense_the_imagined_targets_with_other_noise() -> None:
    """Even the true targets give other detections; those of the coalition are the ones that it has."""
    env = played()
    truth = env.arrays.target_state.copy(), env.arrays.target_alive.copy()
    copies = prepared(env, truth).copies.arrays
    now = env.arrays
    assert np.array_equal(copies.raw_detections[:, :2], now.raw_detections[:, :2])
    there = np.minimum(copies.raw_count, now.raw_count)[:, 2:]
    assert there.sum() > 10
    for w, k in np.argwhere(there > 0):
        n = there[w, k]
        assert not np.isin(copies.raw_detections[w, k + 2, :n], now.raw_detections[w, k + 2, :n]).any()
    again = prepared(env, truth, sample=1).copies.arrays
    assert not np.array_equal(again.raw_detections[:, 2:], copies.raw_detections[:, 2:])


def test_no_random_number_to_come_is_that_of_the_world() -> None:
    """From the very same state and the same actions, copies and worlds go apart at once: targets move differently."""
    env = played()
    truth = env.arrays.target_state.copy(), env.arrays.target_alive.copy()
    copies = prepared(env, truth)
    copies.restore()
    copies.step(np.zeros(env.arrays.action.shape))
    env.step(np.zeros(env.arrays.action.shape))
    assert (env.arrays.target_state[truth[1]] != copies.copies.arrays.target_state[truth[1]]).any(axis=-1).all()


def test_worlds_are_not_changed_by_playing_in_copies() -> None:
    env = played()
    before = env.worlds.rows.copy()
    copies = prepared(env)
    for _ in range(2):
        copies.restore()
        for _ in range(3):
            copies.step(np.ones(env.arrays.action.shape))
    assert np.array_equal(env.worlds.rows, before)


def test_the_same_actions_from_the_same_state_do_the_same_damage() -> None:
    env = played()
    copies, found = prepared(env), []
    for fire in (1.0, 0.0, 1.0):
        copies.restore()
        for _ in range(8):
            copies.step(np.full(env.arrays.action.shape, fire))
        found.append(copies.damage())
    assert np.array_equal(found[0], found[2]) and (found[0] != found[1]).any()


def test_damage_is_against_the_imagined_targets() -> None:
    """Nothing imagined: every track of the picture is false, and nothing can be missing but what is born."""
    env = played()
    copies = prepared(env, (imagined(env)[0], np.zeros((W, 64), dtype=bool)))
    copies.restore()
    copies.step(np.zeros(env.arrays.action.shape))
    arrays = copies.copies.arrays
    assert np.array_equal(copies.damage(), arrays.false_tracks + arrays.missing_targets)
    assert np.array_equal(arrays.false_tracks, arrays.published.sum(axis=1)) and (arrays.false_tracks > 0).all()


def test_what_is_recorded_of_the_frames_to_come_is_hidden(tmp_path: Path) -> None:
    """Over a recording of targets that circle, imagined ones go straight on."""
    angles = np.arange(60) / 5.0
    lines = [f"{t},{n},{200 * np.cos(a + n)},{200 * np.sin(a + n)}" for n in range(4) for t, a in enumerate(angles)]
    (tmp_path / "circles.csv").write_text("\n".join(["t,id,x,y", *lines]) + "\n")
    fields = {"area": [-500.0, 500.0, -500.0, 500.0], "dt": 1.0, "team": {"placement": "overlapping"}}
    targets = {"data": str(tmp_path / "circles.csv")}
    env = played({"base": "skies", "knowledge": "white_box", "targets": targets, **fields})
    recorded = env.arrays.target_state[:, :1].copy()
    assert np.hypot(recorded[..., 0], recorded[..., 1]) == pytest.approx(200.0)
    copies = prepared(env, (recorded, np.ones((W, 1), dtype=bool)))
    copies.restore()
    for _ in range(3):
        copies.step(np.zeros(env.arrays.action.shape))
        env.step(np.zeros(env.arrays.action.shape))
    straight = recorded[:, 0, :2] + 3.0 * recorded[:, 0, 2:]  # m; process noise adds about 1 m, the circle 24 m
    assert np.abs(copies.copies.arrays.target_state[:, 0, :2] - straight).max() < 5.0
    assert np.linalg.norm(env.arrays.target_state[:, 0, :2] - straight, axis=-1).min() > 15.0


class Counting:
    """Publishes all confirmed tracks in even frames and none in odd ones; its memory is a number of its own."""

    name = "counting"

    def reset(self, shape: Any, worlds: np.ndarray) -> None:
        self.frames = 0

    def update(self, evidence: Any) -> Any:
        from trust_env.defenses import Verdict

        self.frames += 1
        return Verdict(publish=(evidence.status == 2) & (self.frames % 2 == 0))


def test_a_users_own_defense_goes_on_from_its_memory_and_keeps_it() -> None:
    env = played(defense=Counting(), frames=15)
    own = env.worlds.own_defense
    assert isinstance(own, Counting) and own.frames == 15
    copies = prepared(env)
    for _ in range(2):
        copies.restore()
        shown = []
        for _ in range(3):
            copies.step(np.zeros(env.arrays.action.shape))
            shown.append(copies.copies.arrays.published.any())
        assert shown == [True, False, True] and own.frames == 15


class Honest:
    """The zero action; remembers its last context."""

    context: Any = None

    def reset(self, context: Any) -> None:
        self.context = context

    def act(self, observations: np.ndarray) -> np.ndarray:
        return np.zeros((*observations.shape[:2], ActionTable(self.context.scenario).size), dtype=np.float32)


@pytest.mark.parametrize("level", ["own", "poses", "picture", "white_box"])
def test_only_white_box_gives_copies(level: str) -> None:
    env, policy = VectorEnv(f"trio(knowledge={level})", "score", 1), Honest()
    Player(env, {"adversary": policy}).actions(env.reset(1)[0])
    assert (policy.context.copies is not None) == (level == "white_box")
