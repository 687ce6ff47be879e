"""Drag and steal: what they do to the tracks of true targets, and to trust."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from attack_runs import injected, play, quiet

from trust_env.agents import Player, build_policy
from trust_env.scenario import load_scenario
from trust_env.training import evaluate
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core

TARGET = {"positions": [[20.0, 0.0]], "velocities": [[0.0, 0.0]]}
TRACKER = {"initial_velocity_variance": 4.0, "process_noise": 0.2, "gate": 0.9999}
ALONE = load_scenario(quiet([{"role": "adversary", "position": [0.0, 0.0]}], targets=TARGET, tracker=TRACKER))


def shifts(attack: str, frames: int = 20, worlds: int = 10) -> np.ndarray:
    """How far reports lie from the target at (20, 0), [frames, W]; NaN: none."""
    return np.array(
        [np.nanmin(np.linalg.norm(injected(env)[:, 0] - [20.0, 0.0], axis=-1), axis=1, initial=np.inf)
         for env, _ in play(ALONE, attack, frames, worlds)]
    )  # fmt: skip


class TestDrag:
    @pytest.mark.parametrize(("profile", "expected"), [("linear", [1.5, 6.0, 12.0]), ("quadratic", [0.75, 12.0, 48.0])])
    def test_the_offset_grows_as_worked_out_by_hand(self, profile: str, expected: list[float]) -> None:
        """Chosen at the third detection (frame 2); then 1.5 t, or 1.5 t²/2."""
        found = shifts(f"drag(rate=1.5, profile={profile}, start=0)", 12)
        for t, offset in zip((1, 4, 8), expected):
            np.testing.assert_allclose(found[2 + t].mean(), offset, atol=0.8)

    def test_the_detection_itself_is_withheld(self) -> None:
        for frame, (env, _) in enumerate(play(ALONE, "drag", 10, 5)):
            assert (env.arrays.report_count[:, 0] == 1).all()
            assert (env.arrays.report_origin[:, 0, 0] <= -2).all() == (frame >= 2)

    def test_the_track_follows_and_trust_rises_while_its_state_goes_wrong(self) -> None:
        agents = [{"role": "adversary", "position": [0.0, 0.0]}, {"role": "adversary", "position": [0.0, 1.0]}]
        world = load_scenario(quiet(agents, targets=TARGET, tracker=TRACKER))
        env = VectorEnv(world, "trust", 10, autoreset=False)
        # Both drag in the same direction, as one that the other copies.
        policy: Any = build_policy("drag(rate=0.5)")
        player, error, trust = Player(env, {"adversary": policy}), [], []
        seen, _ = env.reset(1)
        for _ in range(45):
            actions = player.actions(seen)
            policy.heading[...] = 0.0, 1.0
            seen, *_ = env.step(actions)
            tracks = env.arrays.track_mean[:, 0, :2]
            error.append(np.linalg.norm(tracks - [20.0, 0.0], axis=-1).mean())
            trust.append(env.arrays.agent_trust.mean())
        assert error[8] < 5.0 < 15.0 < error[-1] and trust[-1] > trust[8] > 0.5
        assert (env.arrays.track_status[:, 0] == 2).all() and (env.arrays.track_trust[:, 0] > 0.6).all()

    def test_a_target_is_let_go_where_its_report_would_leave_the_fov(self) -> None:
        for env, _ in play(ALONE, "drag(rate=30)", 30, 10):
            points = injected(env)[:, 0]
            assert np.nanmax(np.linalg.norm(points, axis=-1), initial=0.0) < 99.99  # none on the rim at 100 m

    def test_it_does_damage_on_patrol(self) -> None:
        found = evaluate("patrol", "drag,honest", "score", episodes=20, progress=False)
        drag, honest = (cell.summary["damage_per_frame"].iqm for cell in found.cells)
        assert drag > 3.0 * honest


class TestSteal:
    def test_a_track_takes_the_false_detection_and_the_true_one_starts_a_second_track(self) -> None:
        won, tracks, error = [], {}, {}
        for attack in ("steal", "steal(start=100)"):
            shown, errors = [], []
            for frame, (env, _) in enumerate(play(ALONE, attack, 40, 40)):
                shown.append(env.arrays.published.sum(axis=1).mean())
                errors.append(np.linalg.norm(env.arrays.track_mean[:, 0, :2] - [20.0, 0.0], axis=-1).mean())
                if frame == 2 and attack == "steal":  # its first report
                    injection = env.arrays.report_origin[:, 0] <= -2
                    won.append((injection & (env.arrays.assignment[:, 0] == 0)).any(axis=1).mean())
            tracks[attack], error[attack] = shown[-1], np.mean(errors[3:])
        assert won[0] > 0.5  # nearer to the prediction than most detections
        assert tracks["steal"] > 1.9 and tracks["steal(start=100)"] == 1.0
        assert error["steal"] > 1.5 * error["steal(start=100)"]

    def test_it_doubles_targets_on_patrol_while_its_agents_are_the_most_trusted(self) -> None:
        found = evaluate("patrol", "steal,honest", "trust", episodes=20, progress=False)
        steal, honest = (cell.summary for cell in found.cells)
        assert steal["damage_per_frame"].iqm > honest["damage_per_frame"].iqm + 3.0
        assert steal["adversary_auroc"].iqm < 0.2


@pytest.mark.parametrize("attack", ["drag", "steal", "replay"])
def test_more_targets_than_slots_raise(attack: str) -> None:
    with pytest.raises(ValueError, match="n = 5: expected at most 4, the injection slots of scenario 'patrol'"):
        next(play("patrol", f"{attack}(n=5)", 1))
