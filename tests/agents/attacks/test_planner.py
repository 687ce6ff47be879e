"""`planner`: it does at least what the attacks do that it plans with, and knows no more than it should."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from attack_runs import injected, play

from trust_env import training
from trust_env.agents import Player
from trust_env.agents.attacks.planner import PLANS, Planner
from trust_env.agents.base import PolicyContext
from trust_env.agents.registry import build_policy
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core
PATROL = "patrol(knowledge=white_box)"


def damage(attack: str, defense: str, frames: int = 60, episodes: int = 6) -> float:
    found = training.evaluate(PATROL, attack, defense, episodes, max_cycles=frames, progress=False)
    return found.cells[0].summary["damage_per_frame"].mean


@pytest.mark.parametrize(("defense", "scripted"), [("trust", "by_turns"), ("majority", "outward")])
def test_it_does_as_much_damage_as_the_attack_that_suits_the_defense(defense: str, scripted: str) -> None:
    """By turns does little against `majority`, and outward half of by turns against `trust`."""
    planner = damage("planner(lookahead=8)", defense)
    assert planner > 0.95 * damage(scripted, defense)
    other = {"by_turns": "outward", "outward": "by_turns"}[scripted]
    assert planner > 1.3 * damage(other, defense)


def test_looking_further_ahead_does_more_damage_than_looking_at_the_next_frame_only() -> None:
    """Against `majority` the phantoms of `outward` count only when their tracks are confirmed, frames later."""
    assert damage("planner(lookahead=8)", "majority") > 2.0 * damage("planner(lookahead=1)", "majority")


def planned(change: Any = None) -> np.ndarray:
    """The actions of 12 frames, before each of which the worlds may be changed."""
    env = VectorEnv(PATROL, "trust", 2, autoreset=False)
    player = Player(env, {"adversary": "planner(lookahead=4)"})
    seen, _ = env.reset(5)
    out = []
    for frame in range(12):
        if change is not None:
            change(env, frame)
        actions = player.actions(seen)
        out.append(actions)
        seen, *_ = env.step(actions)
    return np.array(out)


def test_its_actions_do_not_depend_on_the_truth() -> None:
    """Truth and what others have sensed are something else while it plans, and put back for the world's own step."""
    hidden = ("target_state", "target_alive", "raw_detections", "raw_count", "raw_origin", "track_injected_hits")
    rng = np.random.default_rng(0)

    class Masked(Planner):
        env: Any = None

        def act(self, observations: np.ndarray) -> np.ndarray:
            arrays = self.env.arrays
            kept = {name: arrays[name].copy() for name in hidden}
            own = kept["raw_detections"][:, :2], kept["raw_count"][:, :2]
            arrays.target_state[...] = rng.normal(0.0, 400.0, arrays.target_state.shape)
            arrays.target_alive[...] = rng.random(arrays.target_alive.shape) < 0.5
            arrays.raw_detections[...], arrays.raw_count[...], arrays.raw_origin[...] = 0.0, 3, -1
            arrays.raw_detections[:, :2], arrays.raw_count[:, :2] = own
            arrays.track_injected_hits[...] = 7
            actions = super().act(observations)
            for name, values in kept.items():
                arrays[name][...] = values
            return actions

    env = VectorEnv(PATROL, "trust", 2, autoreset=False)
    policy = Masked(lookahead=4)
    policy.env, player = env, Player(env, {"adversary": policy})
    seen, _ = env.reset(5)
    found = []
    for _ in range(12):
        found.append(player.actions(seen))
        seen, *_ = env.step(found[-1])
    assert np.array_equal(found, planned())


def test_its_actions_depend_on_the_scores_that_white_box_shows() -> None:
    def lower(env: VectorEnv, frame: int) -> None:
        env.arrays.track_score[...] -= 3.0 * (frame == 8)

    assert not np.array_equal(planned(lower), planned())


def test_a_new_episode_in_one_world_does_not_change_the_others() -> None:
    def actions(begin_again: bool) -> np.ndarray:
        env = VectorEnv(PATROL, "trust", 2, max_cycles=100)
        player = Player(env, {"adversary": "planner(lookahead=3)"})
        seen, _ = env.reset(5)
        out = []
        for frame in range(10):
            if begin_again and frame == 5:
                env.arrays.episode[1] += 1
                with env.worlds.use:
                    env.worlds.start(np.array([False, True]))
                    env.worlds.use.unfinished = False
                seen = env.arrays.observation.copy()
            out.append(player.actions(seen))
            seen, *_ = env.step(out[-1])
        return np.array(out)

    apart, undisturbed = actions(True), actions(False)
    assert np.array_equal(apart[:, 0], undisturbed[:, 0])
    assert not np.array_equal(apart[5:, 1], undisturbed[5:, 1])


def test_targets_are_imagined_where_confirmed_tracks_are_no_phantoms() -> None:
    """By hand: of three tracks one is tentative, one stands at a phantom, one is a target."""
    env = VectorEnv(PATROL, "score", 1, autoreset=False)
    policy = Planner(lookahead=2)
    player = Player(env, {"adversary": policy})
    player.actions(env.reset(2)[0])
    (place,) = policy.phantoms.sets[0].position[0, 0][policy.phantoms.sets[0].reports[0, 0]][:1]
    tracks, status = np.zeros((1, 1, 64, 4)), np.zeros((1, 1, 64))
    tracks[0, 0, :3, :2] = place
    tracks[0, 0, :3, 0] += 500.0, 10.0, 900.0
    status[0, 0, :3] = 0.5, 1.0, 1.0
    _, present = policy.imagined_targets({"tracks": tracks, "tracks_status": status})
    assert np.flatnonzero(present[0]).tolist() == [2]
    tracks[0, 0, 1, 0] = place[0] + 25.0  # beyond the match distance of 20 m
    _, present = policy.imagined_targets({"tracks": tracks, "tracks_status": status})
    other_phantoms_near = policy.phantoms.near(tracks[:, 0], 20.0)[0, 1]
    assert present[0, 1] == (not other_phantoms_near)


def test_phantoms_that_are_withdrawn_are_not_believed_to_be_reported() -> None:
    """A plan of silence injects nothing, and the forecast of the phantoms' tracks knows it."""
    env = VectorEnv(PATROL, "score", 1, autoreset=False)
    policy = Planner(lookahead=1)
    player = Player(env, {"adversary": policy})
    seen, _ = env.reset(2)
    env.step(player.actions(seen))
    silent = np.array([PLANS.index((None, False, False))])
    for _ in range(60):
        actions = policy.phantoms.act(silent, env.arrays.observation[:, :2].copy())
        assert (env.action_table.injections(actions)[..., 0] <= 0.0).all()
    forecast: Any = policy.phantoms.sets[0]
    assert not forecast.forecast.exists.any()


def test_every_plan_does_in_the_world_what_it_says() -> None:
    for number, plan in enumerate(PLANS):
        env = VectorEnv(PATROL, "score", 2, autoreset=False)
        policy = Planner(lookahead=1)
        player = Player(env, {"adversary": policy})
        seen, _ = env.reset(2)
        seen, *_ = env.step(player.actions(seen))
        before = [phantoms.position.copy() for phantoms in policy.phantoms.sets]
        actions = np.zeros((2, 5, env.action_table.size), dtype=np.float32)
        actions[:, :2] = policy.phantoms.act(np.full(2, number), seen[:, :2])
        sensed = env.arrays.raw_count[:, :2].copy()
        env.step(actions)
        points = injected(env)
        assert (~np.isnan(points)).any() == (plan.reported is not None)
        moved = [not np.array_equal(p.position, b) for p, b in zip(policy.phantoms.sets, before)]
        assert moved == [plan.moves and plan.reported == number for number in range(2)]
        honest = env.arrays.report_count[:, :2] - (~np.isnan(points[:, :2, :, 0])).sum(axis=-1)
        assert np.array_equal(honest, 0 * sensed if plan.withholds else sensed)


def test_it_needs_white_box_and_a_player() -> None:
    with pytest.raises(ValueError, match="'planner' needs knowledge level 'white_box'"):
        list(play("patrol(knowledge=picture)", "planner", 1))
    env = VectorEnv(PATROL, "score", 1)
    one = np.zeros(1, dtype=np.int64)
    context = PolicyContext(env.scenario, env.observation_table, np.arange(2), 1, one, one, one == 0)
    with pytest.raises(ValueError, match="expected worlds to copy, which a Player gives"):
        build_policy("planner").reset(context)
    with pytest.raises(ValueError, match="lookahead"):
        build_policy("planner(lookahead=0)")
