"""Framing and collusion: who sees the phantoms, who is accused, and who is believed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from attack_runs import injected, observers, play, quiet

from trust_env.agents import Player, build_policy
from trust_env.scenario import load_scenario
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core

PATROL = load_scenario("patrol", knowledge="poses")


def trust_after(attack: Any, frames: int = 100, worlds: int = 30) -> tuple[np.ndarray, float]:
    """Trust in the agents [W, K], and the mean trust in injected tracks, under `trust` on patrol."""
    env = VectorEnv(PATROL, "trust", worlds, autoreset=False)
    player = Player(env, {"adversary": attack})
    seen, _ = env.reset(3)
    for _ in range(frames):
        seen, *_ = env.step(player.actions(seen))
    shown = env.arrays.track_injected & (env.arrays.track_status == 2)
    tracks = env.arrays.track_trust[shown]
    return env.arrays.agent_trust.copy(), float(np.nanmean(tracks)) if tracks.size else np.nan


class TestFraming:
    def test_only_adversaries_and_the_victim_see_the_phantoms(self) -> None:
        policy: Any = build_policy("framing(hit_rate=1, noise=0)")
        for env, _ in play(PATROL, policy, 2, 30):
            points = injected(env)
            there = ~np.isnan(points[..., 0])
            honest = observers(env, np.where(there[..., None], points, 1e6), "benign")
            assert there.sum() > 200 and (honest[there] == 1).all()
            apart = np.linalg.norm(points[:, :, :, None] - env.arrays.pose[:, None, None, 2:, :2], axis=-1)
            sees = apart <= 350.0
            np.testing.assert_array_equal(
                sees[there], np.broadcast_to(policy.victims[:, None, None], sees.shape)[there]
            )

    def test_the_victim_can_be_chosen(self) -> None:
        policy: Any = build_policy("framing(victim=2)")
        next(play(PATROL, policy, 1, 10))
        assert policy.victims.tolist() == [[False, False, True]] * 10
        with pytest.raises(ValueError, match="victim = 3: expected a number below 3, that of the honest agents"):
            next(play(PATROL, "framing(victim=3)", 1))

    def test_trust_in_the_victim_falls_and_in_no_other_honest_agent(self) -> None:
        policy: Any = build_policy("framing")
        framed, control = trust_after(policy)[0][:, 2:], trust_after("honest")[0][:, 2:]
        assert framed[policy.victims].mean() < control[policy.victims].mean() - 0.15
        assert abs(framed[~policy.victims].mean() - control[~policy.victims].mean()) < 0.03
        assert framed[policy.victims].mean() < framed[~policy.victims].mean() - 0.15

    def test_without_honest_agents_there_is_nobody_to_frame(self) -> None:
        alone = quiet([{"role": "adversary", "position": [0.0, 0.0]}], knowledge="poses")
        policy: Any = build_policy("framing(n=2)")
        *_, (env, _) = play(load_scenario(alone), policy, 2)
        assert policy.missing_phantoms.tolist() == [2] and env.arrays.report_count[0, 0] == 0


class TestCollusion:
    def test_all_report_the_same_phantoms_where_they_outnumber_honest_agents(self) -> None:
        policy: Any = build_policy("collusion(hit_rate=1, noise=0)")
        for env, _ in play(PATROL, policy, 1, 30):
            position = policy.position[:, 0]
            assert position.shape == (30, 3, 2) and policy.reports.mean() > 0.9  # a slot is left
            assert (observers(env, position, "adversary") > observers(env, position, "benign")).all()

    def test_a_target_that_one_misses_is_reported_on_what_the_other_has_detected(self) -> None:
        """Two adversaries at one place see one target in half of the frames each: together in three of four."""
        target = {"positions": [[30.0, 0.0]], "velocities": [[0.0, 0.0]]}
        world = quiet([{"role": "adversary", "position": [0.0, 0.0]} for _ in range(2)], targets=target)
        scenario = load_scenario(world, **{"sensor.p_detect": 0.5, "knowledge": "poses"})
        lone, both, looks = 0, 0, 0
        for frame, (env, _) in enumerate(play(scenario, "collusion(n=1, hit_rate=0)", 40, 60)):
            sees = (env.arrays.report_origin[..., 0] == 0) & (env.arrays.report_count > 0)
            reports = env.arrays.report_count > 0
            if frame:
                lone, both = lone + (sees.sum(axis=1) == 1).sum(), both + (reports.sum(axis=1) == 2).sum()
                looks += 60
        assert abs(lone / looks - 0.5) < 0.05  # one saw it, the other did not
        # Both saw it (1/4), or one did and somebody had in the frame before (1/2 of 3/4).
        assert abs(both / looks - (0.25 + 0.5 * 0.75)) < 0.06

    def test_colluders_are_trusted_more_than_honest_agents(self) -> None:
        collusion, tracks = trust_after("collusion")
        careful, careful_tracks = trust_after("fov_aware(n=3)")
        assert collusion[:, :2].mean() > collusion[:, 2:].mean() + 0.01
        assert careful[:, :2].mean() < careful[:, 2:].mean()
        assert tracks > careful_tracks + 0.03
