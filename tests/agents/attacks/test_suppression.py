"""Suppression: which tracks it deletes, and which targets it keeps to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from attack_runs import play, quiet

from trust_env.agents import Player
from trust_env.scenario import load_scenario
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core


class TestSuppress:
    ALONE = quiet(
        [{"role": "adversary", "position": [0.0, 0.0]}],
        targets={"positions": [[20.0, 0.0], [0.0, 30.0], [-40.0, 0.0], [0.0, -50.0]], "velocities": None},
        dt=0.1,
    )

    def test_a_track_that_nobody_else_sees_is_deleted(self) -> None:
        """A miss costs ln(0.1) = -2.30; below -10 after five of them."""
        scenario = load_scenario(self.ALONE, **{"targets.speed": [0.0, 0.0], "tracker.confirmed_drop": 10.0})
        shown = [env.arrays.published[0].sum() for env, _ in play(scenario, "suppress(choice=all, start=10)", 16)]
        assert shown[9:] == [4, 4, 4, 4, 4, 0, 0]

    def test_a_fraction_of_half_deletes_half_of_the_tracks(self) -> None:
        scenario = load_scenario(self.ALONE, **{"targets.speed": [0.0, 0.0]})
        *_, (env, _) = play(scenario, "suppress(choice=nearest, fraction=0.5, start=10)", 20)
        left = env.arrays.track_mean[0, env.arrays.published[0], :2]
        np.testing.assert_allclose(sorted(np.linalg.norm(left, axis=1)), [40.0, 50.0], atol=1.0)

    def suppressed(self, scenario: Any, attack: str, frames: int) -> list[set[int]]:
        """Targets that the adversary kept silent about, frame by frame."""
        env = VectorEnv(scenario, "score", 1)
        player, out = Player(env, {"adversary": attack}), []
        seen, _ = env.reset(2)
        for _ in range(frames):
            actions, sensed = (
                player.actions(seen),
                set(env.arrays.raw_origin[0, 0, : env.arrays.raw_count[0, 0]]),
            )
            seen, *_ = env.step(actions)
            out.append(sensed - set(env.arrays.report_origin[0, 0, : env.arrays.report_count[0, 0]]))
        return out

    @pytest.mark.parametrize("attack", ["suppress", "suppress(choice=all)", "suppress(choice=nearest, fraction=0.1)"])
    def test_listed_suppressions_are_replayed_whatever_the_choice(self, attack: str) -> None:
        listed = {"suppressions": [{"agent": 0, "target": 1}, {"agent": 0, "target": 3}]}
        scenario = load_scenario(self.ALONE | listed, **{"targets.speed": [0.0, 0.0]})
        assert self.suppressed(scenario, attack, 20) == [{1, 3}] * 20

    def test_a_listed_target_stays_suppressed_while_it_moves(self) -> None:
        moving = {"velocities": [[15.0, 0.0], [0.0, 10.0], [10.0, 0.0], [0.0, 10.0]]}
        tracker = {"initial_velocity_variance": 100.0, "process_noise": 0.1}
        targets = {"targets": self.ALONE["targets"] | moving, "tracker": tracker}
        scenario = load_scenario(self.ALONE | targets | {"suppressions": [{"agent": 0, "target": 2}]})
        assert self.suppressed(scenario, "suppress(start=5)", 40) == [set()] * 5 + [{2}] * 35

    def test_an_agent_without_listed_suppressions_reports_everything(self) -> None:
        case = load_scenario("case1_fn")
        env = VectorEnv(case, "score", 2)
        player = Player(env, {"adversary": "suppress", "benign": "suppress"})
        seen, _ = env.reset(0)
        for _ in range(5):
            sensed = env.arrays.raw_count.copy()
            seen, *_ = env.step(player.actions(seen))
            assert (sensed - env.arrays.report_count == [1, 0, 1]).all()

    @pytest.mark.parametrize(("fraction", "count"), [(0.25, 1), (0.5, 2), (0.6, 3), (1.0, 4)])
    def test_the_nearest_targets_stay_chosen_when_they_are_no_longer_nearest(self, fraction: float, count: int) -> None:
        moving = {"velocities": [[15.0, 0.0], [0.0, 10.0], [10.0, 0.0], [0.0, 10.0]]}
        tracker = {"initial_velocity_variance": 100.0, "process_noise": 0.1}
        scenario = load_scenario(self.ALONE | {"targets": self.ALONE["targets"] | moving, "tracker": tracker})
        found = self.suppressed(scenario, f"suppress(choice=nearest, fraction={fraction})", 40)
        assert found == [set(range(count))] * 40

    def test_a_chosen_target_stays_chosen(self) -> None:
        """Under misses, clutter and crossings a target that is suppressed once is so nearly always."""
        env = VectorEnv("patrol", "score", 40)
        player = Player(env, {"adversary": "suppress(fraction=0.5)"})
        seen, _ = env.reset(4)
        kept, dropped = (np.zeros((40, 2, 12)) for _ in range(2))
        for _ in range(30):
            actions = player.actions(seen)
            origin = env.arrays.raw_origin[:, :2].copy()
            mask = (np.arange(16) < env.arrays.raw_count[:, :2, None]) & (origin >= 0)
            seen, *_ = env.step(actions)
            drop = actions[:, :2, 12:] > 0
            for w, k, d in np.argwhere(mask):
                (dropped if drop[w, k, d] else kept)[w, k, origin[w, k, d]] += 1
        looks = kept + dropped
        seen_often = looks >= 10
        minority = np.minimum(kept, dropped)[seen_often].sum() / looks[seen_often].sum()
        share = dropped.sum() / looks.sum()
        assert seen_often.sum() > 200 and minority < 0.03 and 0.4 < share < 0.6


class TestSelectiveSuppress:
    def test_it_suppresses_only_where_adversaries_outnumber_honest_agents(self) -> None:
        """Two adversaries and one honest agent see the first target, the honest and one adversary the second."""
        agents = [{"role": "adversary", "position": [0.0, 0.0]}, {"role": "adversary", "position": [-120.0, 0.0]}]
        agents += [{"role": "benign", "position": [0.0, 0.0]}]
        targets = {"positions": [[-50.0, 0.0], [50.0, 0.0]], "velocities": [[0.0, 0.0]] * 2}
        scenario = load_scenario(quiet(agents, targets=targets, knowledge="poses"))
        for frame, (env, _) in enumerate(play(scenario, "selective_suppress(start=1)", 4)):
            reported = [set(env.arrays.report_origin[0, k, : env.arrays.report_count[0, k]]) for k in range(3)]
            assert reported == ([{0, 1}, {0}, {0, 1}] if frame == 0 else [{1}, set(), {0, 1}])

    def test_a_true_track_is_distrusted_and_its_honest_observer_accused(self) -> None:
        agents = [{"role": role, "position": [0.0, 0.0]} for role in ("adversary", "adversary", "benign")]
        targets = {"positions": [[20.0, 0.0], [0.0, 30.0]], "velocities": [[0.0, 0.0]] * 2}
        scenario = load_scenario(quiet(agents, targets=targets, knowledge="poses"))
        trust = {}
        for attack in ("selective_suppress(start=10)", "honest"):
            env = VectorEnv(scenario, "majority", 5, autoreset=False)
            player = Player(env, {"adversary": attack})
            seen, _ = env.reset(2)
            for _ in range(40):
                seen, *_ = env.step(player.actions(seen))
            confirmed = env.arrays.track_status == 2
            trust[attack] = (env.arrays.track_trust[confirmed].max(initial=0.0), *env.arrays.agent_trust.mean(axis=0))
        track, first, second, honest = trust["selective_suppress(start=10)"]
        assert track < 0.5 and honest < 0.4 < 0.6 < min(first, second)
        assert trust["honest"][0] > 0.9 and trust["honest"][3] > 0.9
