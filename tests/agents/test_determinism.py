"""The same actions in whatever batch, and from the seed alone."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from attack_runs import SHAPES, VARIANTS, patrol_for, play

from trust_env.agents import Player, PolicyContext, build_policy
from trust_env.scenario import load_scenario
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core


class TestDeterminism:
    FRAMES = 6

    def actions(self, scenario: Any, attack: str, worlds: list[int], seed: int = 11) -> np.ndarray:
        """[frames, W, K, A] of the third episode of the given worlds."""
        where = {"worlds": np.array(worlds), "episodes": np.full(len(worlds), 2)}
        run = play(scenario, attack, self.FRAMES, len(worlds), seed, options=where)
        return np.array([actions for _, actions in run])

    @pytest.mark.parametrize("attack", VARIANTS)
    def test_actions_do_not_depend_on_the_batch(self, attack: str) -> None:
        scenario = patrol_for(attack)
        few = self.actions(scenario, attack, list(range(7)))
        assert np.isfinite(few).all() and (np.abs(few) <= 1.0).all() and few.dtype == np.float32
        assert few.shape == (self.FRAMES, 7, 5, 28)
        many = self.actions(scenario, attack, [*range(100, 349), *reversed(range(7))])
        np.testing.assert_array_equal(many[:, -7:], few[:, ::-1])
        np.testing.assert_array_equal(self.actions(scenario, attack, [4]), few[:, 4:5])

    @pytest.mark.parametrize("shape", SHAPES)
    def test_actions_do_not_depend_on_the_batch_for_any_fov_shape(self, shape: str) -> None:
        scenario = {"base": "patrol", "fov": SHAPES[shape], "knowledge": "poses"}
        for attack in ("false_positive(motion=constant_velocity, speed=60)", "fov_aware"):
            few = self.actions(scenario, attack, list(range(5)))
            for w in range(5):
                np.testing.assert_array_equal(self.actions(scenario, attack, [w]), few[:, w : w + 1])

    @pytest.mark.parametrize("attack", ["random", "false_positive", "optimal_false_positive", "suppress"])
    def test_actions_depend_on_seed_world_and_episode(self, attack: str) -> None:
        base = self.actions("patrol", attack, [0])
        other = {"worlds": np.array([0]), "episodes": np.array([3])}
        runs = [self.actions("patrol", attack, [1]), self.actions("patrol", attack, [0], seed=12)]
        runs.append(np.array([a for _, a in play("patrol", attack, self.FRAMES, 1, 11, options=other)]))
        for run in runs:
            assert (run != base).any()

    @pytest.mark.parametrize("attack", [attack for attack in VARIANTS if attack != "planner"])  # it needs a player
    def test_a_new_episode_in_one_world_does_not_change_the_others(self, attack: str) -> None:
        scenario = load_scenario("patrol", knowledge="poses")
        seen = {key: self.watched(scenario, *key) for key in ((0, 0), (5, 2))}
        alone = {key: self.by_hand(scenario, attack, [(0, [key], seen[key][:, None])]) for key in seen}
        before = np.stack([seen[0, 0], seen[0, 0]], axis=1)[:4]
        after = np.stack([seen[0, 0][4:], seen[5, 2][: self.FRAMES - 4]], axis=1)
        both = self.by_hand(scenario, attack, [(0, [(0, 0), (0, 0)], before), (1, [(0, 0), (5, 2)], after)])
        np.testing.assert_array_equal(both[:, 0], alone[0, 0][:, 0])
        np.testing.assert_array_equal(both[:4, 1], alone[0, 0][:4, 0])
        np.testing.assert_array_equal(both[4:, 1], alone[5, 2][: self.FRAMES - 4, 0])

    def watched(self, scenario: Any, world: int, episode: int) -> np.ndarray:
        """What the adversaries see in an honest episode, [frames, n, O]."""
        env = VectorEnv(scenario, "score", 1, autoreset=False)
        seen, _ = env.reset(11, options={"worlds": [world], "episodes": [episode]})
        out = []
        for _ in range(self.FRAMES):
            out.append(seen[0, :2])
            seen, *_ = env.step(np.zeros((1, 5, 28)))
        return np.array(out)

    def by_hand(self, scenario: Any, attack: str, parts: list[Any]) -> np.ndarray:
        """Without a player: parts of (first row that begins, [(world, episode)], observations[T, W, n, O])"""
        policy, table = build_policy(attack), VectorEnv(scenario, "score", 1).observation_table
        out = []
        for first, identities, observations in parts:
            worlds, episodes = np.array(identities).T
            mask = np.arange(len(worlds)) >= first
            policy.reset(PolicyContext(scenario, table, np.arange(2), 11, worlds, episodes, mask))
            out += [policy.act(frame) for frame in observations]
        return np.array(out)

    def test_global_random_state_is_not_changed(self) -> None:
        before = str(np.random.get_state())  # noqa: NPY002
        for attack in VARIANTS:
            self.actions(patrol_for(attack), attack, [0])
        assert str(np.random.get_state()) == before  # noqa: NPY002

    @pytest.mark.parametrize("attack", VARIANTS)
    def test_copies_and_pickles_act_alike(self, attack: str) -> None:
        env = VectorEnv(patrol_for(attack), "score", 2)
        player = Player(env, {"adversary": attack})
        seen, _ = env.reset(5)
        for _ in range(3):
            seen, *_ = env.step(player.actions(seen))
        policy = player.coalitions[0][0]
        twins = [copy.deepcopy(policy), pickle.loads(pickle.dumps(policy))]
        for _ in range(3):
            expected = policy.act(seen[:, :2])
            for twin in twins:
                np.testing.assert_array_equal(twin.act(seen[:, :2]), expected)
