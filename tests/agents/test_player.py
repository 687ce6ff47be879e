"""Players: coalitions, episodes, and the same actions in one world and in a batch."""

from __future__ import annotations

import numpy as np
import pytest

from trust_env.agents import Player, Policy, build_policy, name_of
from trust_env.parallel import parallel_env
from trust_env.vector import VectorEnv, vector_env

pytestmark = pytest.mark.core


class TestPlayer:
    def test_a_parallel_env_and_a_batch_of_one_get_the_same_actions(self) -> None:
        env, venv = parallel_env("trio"), vector_env("trio")
        players = [Player(e, {"adversary": "false_positive", "benign": "random"}) for e in (env, venv)]
        (seen, _), (batch, _) = env.reset(seed=8), venv.reset(8)
        while env.agents:
            actions, both = players[0].actions(seen), players[1].actions(batch)
            assert list(actions) == env.possible_agents
            np.testing.assert_array_equal(np.stack(list(actions.values())), both[0])
            assert all(env.action_space(name).contains(action) for name, action in actions.items())
            (seen, *_), (batch, *_) = env.step(actions), venv.step(both)

    def test_a_player_needs_no_reset_between_episodes(self) -> None:
        env = VectorEnv("trio", "score", 2, max_cycles=4)
        player, runs = Player(env, {"adversary": "false_positive"}), []
        for _ in range(2):
            seen, _ = env.reset(6)
            actions = []
            for _ in range(8):  # two episodes of four frames
                actions.append(player.actions(seen))
                seen, *_ = env.step(actions[-1])
            runs.append(actions)
        np.testing.assert_array_equal(runs[0], runs[1])
        assert (runs[0][0] != runs[0][4]).any()

    def test_coalitions_are_formed_by_role_name_and_object(self) -> None:
        env = vector_env("patrol")
        shared = build_policy("optimal_false_positive")
        player = Player(env, {"adversary": "random", "adversary_1": shared, "benign_2": shared})
        assert [(name_of(p), k.tolist()) for p, k in player.coalitions] == [
            ("random", [0]),
            ("optimal_false_positive", [1, 4]),
            ("honest", [2, 3]),
        ]
        with pytest.raises(ValueError, match="unknown role or agent 'adversery'; did you mean 'adversary'"):
            Player(env, {"adversery": "random"})

    def test_a_policy_for_a_role_without_agents_does_nothing(self) -> None:
        env = vector_env("patrol(n_adversaries=0)", num_worlds=2)
        seen, _ = env.reset(1)
        assert not Player(env, {"adversary": "random"}).actions(seen).any()

    def test_actions_of_a_wrong_shape_raise_and_name_the_policy(self) -> None:
        class Short(Policy):
            name = "short"

            def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
                return self.zero_actions()[..., 1:]

        env = vector_env("trio")
        seen, _ = env.reset(1)
        with pytest.raises(ValueError, match=r"'short' returned actions of shape \[1, 1, 17\]; expected \[1, 1, 18\]"):
            Player(env, {"adversary": Short()}).actions(seen)

    def test_missing_methods_and_calls_raise_with_what_is_missing(self) -> None:
        env = vector_env("trio")
        seen, _ = env.reset(1)
        with pytest.raises(ValueError, match=r"Policy\.act raised .*Policy needs a method choose\(self, seen\)"):
            Player(env, {"adversary": Policy()}).actions(seen)
        with pytest.raises(RuntimeError, match="false_positive: call reset"):
            build_policy("false_positive").act(seen[:, :1])
        with pytest.raises(TypeError, match="a player plays a parallel_env or a vector_env of trust_env; got 3"):
            Player(3)
