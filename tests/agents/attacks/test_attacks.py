"""Policies: numbers worked out by hand, budgets, knowledge, and the same actions in whatever batch."""

from __future__ import annotations

import copy
import math
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from trust_env.agents import (
    POLICIES,
    Player,
    Policy,
    PolicyContext,
    build_policy,
    check_knowledge,
    knowledge_of,
    name_of,
    policies,
    sufficient_knowledge,
)
from trust_env.agents.attacks.detection_tracker import PATIENCE, Follower
from trust_env.parallel import parallel_env
from trust_env.scenario import Fovs, load_scenario
from trust_env.spaces.action import encode_action
from trust_env.theory import score_optimal_frames
from trust_env.vector import VectorEnv, vector_env

pytestmark = pytest.mark.core

SCRIPTED = [name for name in POLICIES if name != "learned"]  # that one: test_learned.py
VARIANTS = [
    *SCRIPTED,
    "false_positive(motion=constant_velocity, speed=60)",
    "false_positive(motion=random_walk, n=2)",
    "optimal_false_positive(n=5, hit_rate=0.5)",
    "suppress(choice=nearest, fraction=0.3)",
    "suppress(choice=all)",
    "fov_aware(max_honest=1, n=3)",
    "sleeper(start=2, inner=suppress)",
    "on_off(period=4, inner=fov_aware(n=1))",
]
SHAPES: dict[str, Any] = {
    "circle": {"radius": 350.0},
    "sector": {"type": "sector", "radius": 400.0, "heading": 0.7, "width": 1.9},
    "wide sector": {"type": "sector", "radius": 400.0, "heading": -2.0, "width": 4.0},
    "triangle": {"type": "polygon", "vertices": [[-100.0, -50.0], [50.0, 300.0], [350.0, -20.0]]},
    "pentagon": {
        "type": "polygon",
        "vertices": [[200, 0], [60, 190], [-160, 120], [-160, -120], [60, -190]],
    },
}


def quiet(agents: list[dict[str, Any]], **changes: Any) -> dict[str, Any]:
    """Agents that see perfectly: no clutter, no misses, little noise; no targets unless given."""
    sensor = {"p_detect": 1.0, "sigma": 0.5, "noise_cov": None, "clutter_density": 0.0, "max_detections": 8}
    scenario = {"base": "theorem", "name": "quiet", "dt": 1.0, "agents": agents, "sensor": sensor}
    return scenario | {"injection": {"slots": 3}, "area": [-500.0, 500.0, -500.0, 500.0]} | changes


def play(scenario: Any, attack: Any, frames: int, worlds: int = 1, seed: int = 3, **reset: Any):
    """Plays an attack against `score`; yields the environment and the actions after every frame."""
    env = VectorEnv(scenario, "score", worlds, autoreset=False)
    player = Player(env, {"adversary": attack})
    observations, _ = env.reset(seed, **reset)
    for _ in range(frames):
        actions = player.actions(observations)
        observations, *_ = env.step(actions)
        yield env, actions


def injected(env: VectorEnv) -> np.ndarray:
    """The points that adversaries have injected in the last frame, [W, K, D, 2] m; NaN elsewhere."""
    there = np.arange(env.arrays.report_detections.shape[2]) < env.arrays.report_count[..., None]
    fake = there & (env.arrays.report_origin <= -2)
    return np.where(fake[..., None], env.arrays.report_detections, np.nan)


def observers(env: VectorEnv, points: np.ndarray, role: str) -> np.ndarray:
    """How many agents of a role have each of the points[W, ..., 2] in their circular FOV, [W, ...]."""
    counts = np.zeros(points.shape[:-1], dtype=int)
    for k, other in enumerate(env.scenario.roles):
        if other == role:
            place = env.arrays.pose[:, k, :2].reshape(len(points), *[1] * (points.ndim - 2), 2)
            counts += np.linalg.norm(points - place, axis=-1) <= env.scenario.agent(k).fov.radius
    return counts


class TestNaming:
    def test_all_are_listed_and_made_by_name(self) -> None:
        assert policies() == tuple(POLICIES)
        for name, made in POLICIES.items():
            assert made.name == name and (name not in SCRIPTED or type(build_policy(name)) is made)
            assert (made.__doc__ or "").split("\n")[0].endswith((".", ","))

    def test_parameters_arrive(self) -> None:
        policy: Any = build_policy("false_positive(n=2, motion=random_walk, speed=4, hit_rate=0.5)")
        assert (policy.n, policy.motion, policy.speed, policy.hit_rate) == (2, "random_walk", 4.0, 0.5)
        sleeper: Any = build_policy("sleeper(start=7, inner=on_off(duty=0.25, inner=suppress(choice=all)))")
        inner = sleeper.inner
        assert (inner.duty, inner.inner.choice) == (0.25, "all")

    @pytest.mark.parametrize("name", VARIANTS)
    def test_what_is_written_reads_back(self, name: str) -> None:
        policy = build_policy(name)
        again = build_policy(repr(policy))
        assert repr(again) == repr(policy) and type(again) is type(policy)

    def test_unknown_names_get_a_suggestion(self) -> None:
        with pytest.raises(ValueError, match="unknown policy 'false_positiv'; did you mean 'false_positive'"):
            build_policy("false_positiv")
        with pytest.raises(
            ValueError, match="'suppress' has no parameter 'fractoin'; did you mean 'fraction'"
        ):
            build_policy("suppress(fractoin=0.5)")
        with pytest.raises(ValueError, match="'honest' has no parameter 'n'; it takes: none"):
            build_policy("honest(n=2)")

    @pytest.mark.parametrize(
        ("text", "found"),
        [
            ("false_positive(n=0)", "n = 0: expected a whole number of at least 1"),
            ("false_positive(n=1.5)", "n = 1.5: expected a whole number"),
            ("false_positive(n=True)", "n = True: expected a whole number"),
            (
                "false_positive(motion=statik)",
                "expected one of static, constant_velocity, random_walk; did you mean 'static'?",
            ),
            ("false_positive(speed=-1)", "speed = -1: expected a number of at least 0"),
            ("false_positive(start=-1)", "start = -1: expected a whole number of at least 0"),
            ("false_positive(period=0)", "period = 0: expected a whole number of at least 1"),
            ("false_positive(hit_rate=1.1)", "hit_rate = 1.1: expected a number from 0 to 1"),
            ("optimal_false_positive(n=many)", "n = 'many': expected a whole number"),
            ("suppress(fraction=0)", "fraction = 0: expected a number above 0 and at most 1"),
            ("suppress(choice=far)", "choice = 'far': expected one of random, nearest, all"),
            ("fov_aware(max_honest=-1)", "max_honest = -1: expected a whole number of at least 0"),
            ("sleeper(start=2.5)", "start = 2.5: expected a whole number of at least 0"),
            ("on_off(duty=0)", "duty = 0: expected a number above 0 and at most 1"),
            ("on_off(inner=suppress(choice=far))", "choice = 'far'"),
        ],
    )
    def test_parameters_that_do_not_fit_are_named(self, text: str, found: str) -> None:
        with pytest.raises(ValueError) as caught:
            build_policy(text)
        assert found in str(caught.value)

    def test_more_phantoms_than_slots_are_refused(self) -> None:
        with pytest.raises(ValueError, match="n = 5: expected at most 4, the injection slots of scenario"):
            next(play("patrol", "false_positive(n=5)", 1))
        with pytest.raises(ValueError, match="n = 9: expected at most 8, the injection slots of 2 agents"):
            next(play("patrol", "optimal_false_positive(n=9)", 1))

    def test_own_policies_come_from_files_and_objects(self, tmp_path: Path) -> None:
        file = tmp_path / "mine.py"
        file.write_text(
            "from trust_env import agents\n"
            "class Still(agents.Policy):\n"
            "    name = 'still'\n"
            "    def __init__(self, x=1): self.x = x\n"
            "    def choose(self, seen): return self.nothing() + self.x\n"
        )
        policy = build_policy(f"{file}:Still(x=-1)")
        (_, actions), *_ = play("trio", policy, 1)
        assert (actions[0, 0] == -1).all() and (actions[0, 1:] == 0).all()
        assert build_policy(policy) is policy
        with pytest.raises(ValueError, match="no parameter 'y'; it takes: x"):
            build_policy(f"{file}:Still(y=1)")
        for wrong in (3, None, Policy, object()):
            with pytest.raises(TypeError, match="a policy is a name, or an object with `reset"):
                build_policy(wrong)

    def test_neither_torch_nor_training_is_imported(self) -> None:
        code = "import sys, agents; print(sorted({'torch', 'training', 'pygame'} & set(sys.modules)))"
        found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert found.stdout.strip() == "[]"


class TestKnowledge:
    def test_both_levels_are_named(self) -> None:
        with pytest.raises(
            ValueError, match=r"'fov_aware' needs knowledge level 'poses'.*'patrol' gives 'own'"
        ):
            check_knowledge(build_policy("fov_aware"), load_scenario("patrol"))
        with pytest.raises(ValueError, match=r"patrol\(knowledge=poses\)"):
            Player(vector_env("patrol"), {"adversary": "sleeper(inner=fov_aware)"})
        check_knowledge(build_policy("fov_aware"), load_scenario("patrol", knowledge="picture"))

    def test_the_least_level_that_does(self) -> None:
        own, picture = load_scenario("patrol"), load_scenario("patrol", knowledge="picture")
        attacks = [build_policy("suppress"), build_policy("on_off(inner=fov_aware)")]
        assert knowledge_of(attacks[1]) == "poses"
        assert sufficient_knowledge(own, attacks[0]) == "own"
        assert sufficient_knowledge(own, *attacks) == "poses"
        assert sufficient_knowledge(picture, *attacks) == "picture"

    def test_an_unknown_level_is_refused(self) -> None:
        policy: Any = build_policy("honest")
        policy.knowledge = "everything"
        with pytest.raises(ValueError, match="'everything': expected one of own, poses, picture, white_box"):
            knowledge_of(policy)


class TestDeterminism:
    FRAMES = 6

    def actions(self, scenario: Any, attack: str, worlds: list[int], seed: int = 11) -> np.ndarray:
        """[frames, W, K, A] of the third episode of the given worlds."""
        where = {"worlds": np.array(worlds), "episodes": np.full(len(worlds), 2)}
        run = play(scenario, attack, self.FRAMES, len(worlds), seed, options=where)
        return np.array([actions for _, actions in run])

    @pytest.mark.parametrize("attack", VARIANTS)
    def test_a_world_is_played_the_same_in_every_batch(self, attack: str) -> None:
        scenario = load_scenario("patrol", knowledge="poses")
        few = self.actions(scenario, attack, list(range(7)))
        assert np.isfinite(few).all() and (np.abs(few) <= 1.0).all() and few.dtype == np.float32
        assert few.shape == (self.FRAMES, 7, 5, 28)
        many = self.actions(scenario, attack, [*range(100, 349), *reversed(range(7))])
        np.testing.assert_array_equal(many[:, -7:], few[:, ::-1])
        np.testing.assert_array_equal(self.actions(scenario, attack, [4]), few[:, 4:5])

    @pytest.mark.parametrize("shape", SHAPES)
    def test_so_it_is_for_every_shape_of_fov(self, shape: str) -> None:
        scenario = {"base": "patrol", "fov": SHAPES[shape], "knowledge": "poses"}
        for attack in ("false_positive(motion=constant_velocity, speed=60)", "fov_aware"):
            few = self.actions(scenario, attack, list(range(5)))
            for w in range(5):
                np.testing.assert_array_equal(self.actions(scenario, attack, [w]), few[:, w : w + 1])

    @pytest.mark.parametrize("attack", ["random", "false_positive", "optimal_false_positive", "suppress"])
    def test_seed_world_and_episode_all_matter(self, attack: str) -> None:
        base = self.actions("patrol", attack, [0])
        other = {"worlds": np.array([0]), "episodes": np.array([3])}
        runs = [self.actions("patrol", attack, [1]), self.actions("patrol", attack, [0], seed=12)]
        runs.append(np.array([a for _, a in play("patrol", attack, self.FRAMES, 1, 11, options=other)]))
        for run in runs:
            assert (run != base).any()

    @pytest.mark.parametrize("attack", VARIANTS)
    def test_a_world_that_begins_anew_does_not_disturb_the_others(self, attack: str) -> None:
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

    def test_global_randomness_is_neither_used_nor_touched(self) -> None:
        before = str(np.random.get_state())  # noqa: NPY002
        for attack in VARIANTS:
            self.actions(load_scenario("patrol", knowledge="poses"), attack, [0])
        assert str(np.random.get_state()) == before  # noqa: NPY002

    @pytest.mark.parametrize("attack", VARIANTS)
    def test_copies_go_on_alike(self, attack: str) -> None:
        env = VectorEnv(load_scenario("patrol", knowledge="poses"), "score", 2)
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


class TestBudgets:
    @pytest.mark.parametrize("attack", VARIANTS)
    def test_actions_stay_within_them(self, attack: str) -> None:
        budget = {"injections": 1, "suppressions": 2}
        agents = [{"role": "adversary", "budget": budget}, {"role": "adversary"}, {"role": "benign"}]
        scenario = load_scenario({"base": "patrol", "knowledge": "poses", "agents": agents})
        for env, actions in play(scenario, attack, 5, 8):
            slots, entries = actions[..., :12].reshape(8, 3, 4, 3), actions[..., 12:]
            assert (slots[:, 0, 1:, 0] <= 0).all() and (entries[:, 0, 2:] <= 0).all()
            assert (~np.isnan(injected(env)[:, 0, :, 0])).sum(axis=1).max() <= 1
            assert (actions[:, 2] == 0).all()

    def test_benign_agents_cannot_be_made_to_inject(self) -> None:
        env = VectorEnv("trio", "score", 4)
        player = Player(env, {"benign": "random"})
        seen, _ = env.reset(1)
        for _ in range(5):
            actions = player.actions(seen)
            assert (actions[:, 1:, :6] == 0).all() and (actions[:, 0] == 0).all()
            assert (actions[:, 1:, 6:] > 0).any() and (actions[:, 1:, 6:] < 0).any()
            seen, *_ = env.step(actions)

    def test_random_is_uniform(self) -> None:
        actions = np.array([a[:, :2] for _, a in play("patrol", "random", 20, 32)])
        assert actions.size == 20 * 32 * 2 * 28
        values = actions.reshape(-1)
        # Standard error of a mean of U(-1, 1): 1/sqrt(3 n); of the share in a quarter: sqrt(3/16 n).
        assert abs(values.mean()) < 5 / math.sqrt(3 * values.size)
        shares = np.histogram(values, bins=4, range=(-1, 1))[0] / values.size
        assert np.abs(shares - 0.25).max() < 5 * math.sqrt(3 / 16 / values.size)
        assert len(np.unique(values)) > 0.99 * values.size


class TestTheorem:
    """Theorem 1 of Hallyburton & Pajic 2024 against the simulation."""

    TEAMS = ((1, 0), (1, 1), (1, 2), (1, 3), (1, 4), (1, 5), (2, 0), (2, 3), (2, 4), (2, 6), (3, 0), (3, 3))

    @pytest.mark.parametrize("order", ["adversaries_first", "adversaries_last"])
    @pytest.mark.parametrize("team", TEAMS, ids=str)
    def test_the_injected_track_is_confirmed_in_exactly_that_frame(
        self, team: tuple[int, int], order: str
    ) -> None:
        text = f"theorem(n_adversaries={team[0]}, n_benign={team[1]}, order={order})"
        scenario, worlds = load_scenario(text), 3
        expected = score_optimal_frames(scenario.roles)
        horizon = 25 if math.isinf(expected) else int(expected)
        for frame, (env, _) in enumerate(play(scenario, "optimal_false_positive", horizon, worlds), start=1):
            confirmed = ((env.arrays.track_status == 2) & env.arrays.track_injected).sum(axis=1)
            shown = (env.arrays.published & env.arrays.track_injected).sum(axis=1)
            assert list(confirmed) == [int(frame >= expected)] * worlds
            np.testing.assert_array_equal(shown, confirmed)

    def test_the_frames_are_those_known(self) -> None:
        first = [score_optimal_frames("A" + "B" * k) for k in range(6)]
        assert first == [3, 4, 5, 8, 17, math.inf]

    def test_every_innovation_is_zero(self) -> None:
        for env, _ in play("theorem(n_adversaries=2, n_benign=0)", "optimal_false_positive", 5, 4):
            points = injected(env)[:, :2, 0]
            np.testing.assert_allclose(points[:, 0], points[:, 1], atol=1e-4)
            np.testing.assert_allclose(env.arrays.track_mean[:, 0, :2], points[:, 0], atol=1e-4)
            assert (env.arrays.columns[:, 0] == 1).all()
            assert np.linalg.norm(points, axis=-1).max() < 96.0  # well inside the FOV, radius 100 m

    def test_start_is_the_number_of_honest_frames(self) -> None:
        counts = [
            env.arrays.report_count[0, 0] for env, _ in play("theorem", "optimal_false_positive(start=3)", 6)
        ]
        assert counts == [0, 0, 0, 1, 1, 1]


class TestFalsePositive:
    def test_case_1_gets_its_two_false_tracks(self) -> None:
        scenario = load_scenario("case1")
        *_, (env, _) = play(scenario, "false_positive", 20)
        shown = env.arrays.published[0] & env.arrays.track_injected[0]
        found = env.arrays.track_mean[0, shown, :2]
        listed = np.array([case.position for case in scenario.injections])
        assert shown.sum() == 2 and env.arrays.published[0].sum() == 6
        np.testing.assert_allclose(
            found[np.argsort(found[:, 0])], listed[np.argsort(listed[:, 0])], atol=1e-5
        )

    def test_cases_are_replayed_agent_by_agent_whatever_n(self) -> None:
        for name in ("case1", "case2"):
            scenario = load_scenario(name)
            for env, _ in play(scenario, "false_positive(n=7, motion=random_walk)", 3, 2):
                for k in range(3):
                    listed = [case.position for case in scenario.injections if case.agent == k]
                    points = injected(env)[1, k]
                    points = points[~np.isnan(points[:, 0])]
                    np.testing.assert_allclose(points, np.array(listed).reshape(-1, 2), atol=1e-6)

    def test_phantoms_are_uniform_in_the_own_fov(self) -> None:
        *_, (env, _) = play("patrol", "false_positive(hit_rate=1)", 1, 200)
        offset = injected(env)[:, :2] - env.arrays.pose[:, :2, None, :2]
        share = np.linalg.norm(offset, axis=-1) ** 2 / 350.0**2
        share = share[~np.isnan(share)]
        assert share.size == 200 * 2 * 4 and share.max() <= 1.0
        # A uniform share has mean 1/2 and standard deviation 1/sqrt(12).
        assert abs(share.mean() - 0.5) < 5 / math.sqrt(12 * share.size)
        assert abs(np.nanmean(offset)) < 5 * 175.0 / math.sqrt(share.size)

    def test_it_fires_with_the_detection_probability(self) -> None:
        for attack, rate in (("false_positive", 0.9), ("false_positive(hit_rate=0.3)", 0.3)):
            fired = [(a[:, :2, :12:3] > 0).mean() for _, a in play("patrol", attack, 25, 40)]
            size = 25 * 40 * 2 * 4
            assert abs(np.mean(fired) - rate) < 5 * math.sqrt(rate * (1 - rate) / size)
        agents = [{"role": "adversary"}, {"role": "adversary", "sensor": {"p_detect": 0.5}}]
        fired = [
            a[..., :12:3] > 0 for _, a in play({"base": "patrol", "agents": agents}, "false_positive", 25, 40)
        ]
        np.testing.assert_allclose(np.mean(fired, axis=(0, 1, 3)), [0.9, 0.5], atol=0.05)

    def test_start_and_period_pick_the_frames(self) -> None:
        run = play("trio", "false_positive(n=1, start=2, period=3, hit_rate=1)", 10)
        assert [int((a[0, 0, :6:3] > 0).sum()) for _, a in run] == [0, 0, 1, 0, 0, 1, 0, 0, 1, 0]

    def paths(self, attack: str, frames: int = 40, worlds: int = 20) -> tuple[np.ndarray, np.ndarray]:
        """Two phantoms of each adversary, [frames, W, n, P, 2], and the agents' places, [W, n, 1, 2]."""
        path, place = np.zeros((frames, worlds, 2, 2, 2)), np.zeros((worlds, 2, 1, 2))
        for frame, (env, _) in enumerate(play("patrol", attack, frames, worlds)):
            points, place = injected(env)[:, :2], env.arrays.pose[:, :2, None, :2].copy()
            path[frame] = points[~np.isnan(points[..., 0])].reshape(worlds, 2, 2, 2)
        return path, place

    def test_static_phantoms_stay(self) -> None:
        path, _ = self.paths("false_positive(n=2, hit_rate=1)", 5)
        np.testing.assert_allclose(path, np.broadcast_to(path[0], path.shape), atol=1e-4)

    def test_moving_phantoms_go_straight_on_until_they_leave(self) -> None:
        path, place = self.paths("false_positive(n=2, hit_rate=1, motion=constant_velocity, speed=20)")
        assert (np.linalg.norm(path - place, axis=-1) <= 350.0).all()
        steps = np.diff(path, axis=0)
        length = np.linalg.norm(steps, axis=-1)
        stays = np.abs(length - 20.0) < 1e-3  # 20 m/s for 1 s
        assert 0.85 < stays.mean() < 1.0
        straight = stays[1:] & stays[:-1]
        np.testing.assert_allclose(steps[1:][straight], steps[:-1][straight], atol=1e-3)
        gone = ~stays[1:] & stays[:-1]  # replaced where the next step would have led out
        onward = np.linalg.norm(path[1:-1] + steps[:-1] - place, axis=-1)
        assert gone.sum() > 100 and (onward[gone] > 350.0 - 1e-3).all()
        assert (onward[straight] < 350.0 + 1e-3).all()

    def test_wandering_phantoms_take_steps_of_their_speed(self) -> None:
        path, place = self.paths("false_positive(n=2, hit_rate=1, motion=random_walk, speed=20)")
        assert (np.linalg.norm(path - place, axis=-1) <= 350.0).all()
        steps = np.diff(path, axis=0)
        length = np.linalg.norm(steps, axis=-1)
        moved = length > 1.0
        np.testing.assert_allclose(length[moved], 20.0, atol=1e-3)
        assert length[~moved].max(initial=0.0) < 1e-3 and 0.9 < moved.mean() < 1.0
        turns = (steps[1:] * steps[:-1]).sum(axis=-1)[moved[1:] & moved[:-1]] / 400.0
        assert abs(turns.mean()) < 5 / math.sqrt(2 * turns.size)  # the mean cosine of a uniform turn is 0

    def test_speeds_are_those_of_targets_unless_given(self) -> None:
        path, _ = self.paths("false_positive(n=2, hit_rate=1, motion=constant_velocity)", 2, 60)
        speed = np.linalg.norm(path[1] - path[0], axis=-1)
        speed = speed[speed < 30.0]  # the others are new
        assert 3.0 - 1e-3 < speed.min() < 3.5 and 11.5 < speed.max() < 12.0 + 1e-3


class TestCoalition:
    APART = quiet(
        [
            {"role": "adversary", "position": [-300.0, 0.0]},
            {"role": "adversary", "position": [300.0, 0.0]},
            {"role": "benign", "position": [300.0, 50.0]},
        ],
        knowledge="poses",
    )

    def test_phantoms_are_shared_where_all_fovs_intersect(self) -> None:
        *_, (env, actions) = play("patrol", "optimal_false_positive", 1, 100)
        points = injected(env)
        assert (actions[:, :2, :12:3] > 0).all()
        first, second = (points[:, k][~np.isnan(points[:, k, :, 0])].reshape(100, 4, 2) for k in (0, 1))
        np.testing.assert_allclose(first, second, atol=1e-3)
        assert (observers(env, first, "adversary") == 2).all()
        assert len(np.unique(first.round(3).reshape(-1, 2), axis=0)) == 400

    def test_a_narrow_lens_is_found(self) -> None:
        agents = [
            {"role": "adversary", "position": [x, 0.0]} for x in (-99.5, 99.5)
        ]  # 1 m of 200 m is shared
        *_, (env, _) = play(quiet(agents), "optimal_false_positive(n=1)", 1, 50)
        points = injected(env)
        assert (~np.isnan(points[..., 0])).sum() == 100
        assert np.nanmax(np.abs(points[..., 0])) < 0.5 + 1e-3
        assert 0.3 < np.nanstd(points[..., 1]) / 5.0 < 1.5  # the lens is 20 m high

    def test_where_fovs_do_not_intersect_each_reports_its_own(self) -> None:
        for env, _ in play(self.APART, "optimal_false_positive(n=3)", 2, 30):
            points = injected(env)
            assert (~np.isnan(points[..., 0])).sum() == 90
            assert {int(n) for n in (~np.isnan(points[:, 0, :, 0])).sum(axis=1)} <= {0, 1, 2, 3}

    def test_fov_aware_hides_from_honest_agents(self) -> None:
        for env, _ in play(self.APART, "fov_aware(n=3, hit_rate=1)", 2, 30):
            points = injected(env)
            assert (~np.isnan(points[..., 0])).sum() == 90
            seen = observers(env, np.where(np.isnan(points), 1e6, points), "benign")
            assert (seen == 0).all()

    def test_fewer_honest_agents_see_it_than_a_plain_false_positive(self) -> None:
        scenario = load_scenario("patrol", knowledge="poses")
        mean = {}
        for attack in (
            "false_positive(hit_rate=1)",
            "fov_aware(hit_rate=1)",
            "fov_aware(max_honest=1, hit_rate=1)",
        ):
            *_, (env, _) = play(scenario, attack, 1, 100)
            points = injected(env)[:, :2]
            there = ~np.isnan(points[..., 0])
            counts = observers(env, np.where(there[..., None], points, 1e6), "benign")[there]
            mean[attack] = counts.mean()
            assert "max_honest" not in attack or counts.max() == 1 or (counts == 0).all()
        assert mean["fov_aware(hit_rate=1)"] < 0.5 * mean["false_positive(hit_rate=1)"]

    def test_max_honest_forbids(self) -> None:
        scenario = load_scenario(
            "theorem", knowledge="poses"
        )  # two honest agents at the same place see everything
        for limit, count in ((0, 0), (1, 0), (2, 1)):
            *_, (env, _) = play(scenario, f"fov_aware(max_honest={limit})", 1)
            assert env.arrays.report_count[0, 0] == count

    def test_more_phantoms_than_slots_fill_the_slots(self) -> None:
        *_, (_, actions) = play("patrol", "optimal_false_positive(n=8)", 1, 20)
        assert (actions[:, :2, :12:3] > 0).sum(axis=-1).max() == 4


class TestSuppress:
    ALONE = quiet(
        [{"role": "adversary", "position": [0.0, 0.0]}],
        targets={"positions": [[20.0, 0.0], [0.0, 30.0], [-40.0, 0.0], [0.0, -50.0]], "velocities": None},
        dt=0.1,
    )

    def test_a_track_that_nobody_else_sees_is_deleted(self) -> None:
        """A miss costs ln(0.1) = -2.30; below -10 after five of them."""
        scenario = load_scenario(self.ALONE, **{"targets.speed": [0.0, 0.0], "tracker.confirmed_drop": 10.0})
        shown = [
            env.arrays.published[0].sum() for env, _ in play(scenario, "suppress(choice=all, start=10)", 16)
        ]
        assert shown[9:] == [4, 4, 4, 4, 4, 0, 0]

    def test_only_half_of_it_is_deleted(self) -> None:
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

    @pytest.mark.parametrize(("fraction", "count"), [(0.25, 1), (0.5, 2), (0.6, 3), (1.0, 4)])
    def test_the_nearest_are_chosen_and_followed_when_they_are_so_no_longer(
        self, fraction: float, count: int
    ) -> None:
        moving = {"velocities": [[15.0, 0.0], [0.0, 10.0], [10.0, 0.0], [0.0, 10.0]]}
        tracker = {"initial_velocity_variance": 100.0, "process_noise": 0.1}
        scenario = load_scenario(self.ALONE | {"targets": self.ALONE["targets"] | moving, "tracker": tracker})
        found = self.suppressed(scenario, f"suppress(choice=nearest, fraction={fraction})", 40)
        assert found == [set(range(count))] * 40

    def test_choosing_is_seldom_reconsidered(self) -> None:
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

    def test_following_survives_misses_and_gives_up_in_the_end(self) -> None:
        scenario = load_scenario(quiet([{"role": "adversary", "position": [0.0, 0.0]}]))
        follower = Follower(scenario, np.array([0]), 1)
        points, there = np.zeros((1, 1, 8, 2)), np.zeros((1, 1, 8), dtype=bool)
        there[..., :2] = True

        def look(t: float, *order: int) -> list[int]:
            path = [(3.0 * t, 0.0), (60.0, -3.0 * t)]
            for d, target in enumerate(order):
                points[0, 0, d] = path[target]
            mask = there & (np.arange(8) < len(order))
            return follower.follow(points, mask)[0][0, 0, : len(order)].tolist()

        follower.velocity_variance = 9.0
        assert look(0, 0, 1) == [0, 1]
        assert look(1, 1, 0) == [1, 0]
        assert look(2, 0) == [0]
        assert look(3, 1) == [1]
        for t in range(4, 4 + PATIENCE):
            look(t)
        assert look(4 + PATIENCE, 0) == [
            0
        ]  # missed for PATIENCE + 1 frames: given up, and found anew in the same slot
        assert follower.alive.sum() == 1

    def test_pairs_are_made_by_distance(self) -> None:
        """Greedy, the least first: 2 at 1 m, 10 at 3 m; the detection at 0 gets what is left."""
        scenario = load_scenario(
            quiet(
                [{"role": "adversary", "position": [0.0, 0.0]}],
                sensor={
                    "sigma": 10.0,
                    "noise_cov": None,
                    "p_detect": 1.0,
                    "clutter_density": 0.0,
                    "max_detections": 4,
                },
            )
        )
        follower = Follower(scenario, np.array([0]), 1)
        points, mask = np.zeros((1, 1, 4, 2)), np.array([[[True, True, False, False]]])
        points[0, 0, :2, 0] = 1.0, 7.0
        assert follower.follow(points, mask)[0][0, 0].tolist()[:2] == [0, 1]
        points[0, 0, :3, 0] = 0.0, 2.0, 10.0
        mask[..., 2] = True
        slot, new = follower.follow(points, mask)
        assert (slot[0, 0, :3].tolist(), new[0, 0, :3].tolist()) == ([0, 2, 1], [False, True, False])


class TestTiming:
    def test_a_sleeper_wakes_up(self) -> None:
        awake = [a for _, a in play("patrol", "false_positive", 6, 3)]
        for frame, (_, actions) in enumerate(play("patrol", "sleeper(start=4, inner=false_positive)", 6, 3)):
            np.testing.assert_array_equal(actions, awake[frame] if frame >= 4 else np.zeros_like(actions))

    def test_duty_is_rounded_up_to_frames(self) -> None:
        for duty, on in (
            (0.5, [1, 1, 1, 0, 0]),
            (0.4, [1, 1, 0, 0, 0]),
            (0.01, [1, 0, 0, 0, 0]),
            (1, [1] * 5),
        ):
            run = play("trio", f"on_off(duty={duty}, period=5, inner=false_positive(hit_rate=1))", 10)
            assert [int((a[0, 0] > 0).any()) for _, a in run] == on * 2


class TestPlayer:
    def test_one_world_and_a_batch_of_one_are_played_alike(self) -> None:
        env, venv = parallel_env("trio"), vector_env("trio")
        players = [Player(e, {"adversary": "false_positive", "benign": "random"}) for e in (env, venv)]
        (seen, _), (batch, _) = env.reset(seed=8), venv.reset(8)
        while env.agents:
            actions, both = players[0].actions(seen), players[1].actions(batch)
            assert list(actions) == env.possible_agents
            np.testing.assert_array_equal(np.stack(list(actions.values())), both[0])
            assert all(env.action_space(name).contains(action) for name, action in actions.items())
            (seen, *_), (batch, *_) = env.step(actions), venv.step(both)

    def test_episodes_repeat_and_go_on_without_a_word_to_the_player(self) -> None:
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

    def test_roles_names_and_objects_make_coalitions(self) -> None:
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

    def test_nobody_named_is_nobody_attacking(self) -> None:
        env = vector_env("patrol(n_adversaries=0)", num_worlds=2)
        seen, _ = env.reset(1)
        assert not Player(env, {"adversary": "random"}).actions(seen).any()

    def test_actions_of_a_wrong_shape_name_the_policy(self) -> None:
        class Short(Policy):
            name = "short"

            def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
                return self.nothing()[..., 1:]

        env = vector_env("trio")
        seen, _ = env.reset(1)
        with pytest.raises(
            ValueError, match=r"'short' returned actions of shape \[1, 1, 17\]; expected \[1, 1, 18\]"
        ):
            Player(env, {"adversary": Short()}).actions(seen)

    def test_mistakes_of_authors_are_explained(self) -> None:
        env = vector_env("trio")
        seen, _ = env.reset(1)
        with pytest.raises(NotImplementedError, match=r"Policy needs a method choose\(self, seen\)"):
            Player(env, {"adversary": Policy()}).actions(seen)
        with pytest.raises(RuntimeError, match="false_positive: call reset"):
            build_policy("false_positive").act(seen[:, :1])
        with pytest.raises(
            TypeError, match="a player plays a parallel_env or a vector_env of trust_env; got 3"
        ):
            Player(3)


class TestGeometry:
    """`Fovs` against the simulator."""

    def world(self, shape: str, worlds: int = 16) -> tuple[VectorEnv, Fovs, np.ndarray]:
        agents = [{"role": "adversary"}, {"role": "benign", "heading": 1.0}]
        env = VectorEnv({"base": "patrol", "agents": agents, "fov": SHAPES[shape]}, "score", worlds)
        seen, _ = env.reset(9)
        pose = env.observation_table.read(seen, np.arange(2))["pose"]
        return env, Fovs.of(env.scenario, np.arange(2)), pose

    @pytest.mark.parametrize("shape", SHAPES)
    def test_boxes(self, shape: str) -> None:
        env, fovs, pose = self.world(shape)
        np.testing.assert_allclose(fovs.boxes(pose), env.arrays.fov_box, atol=1e-3)

    @pytest.mark.parametrize("shape", SHAPES)
    def test_the_simulator_leaves_just_those_points_where_they_are_that_are_contained(
        self, shape: str
    ) -> None:
        env, fovs, pose = self.world(shape)
        rng, checked = np.random.default_rng(1), 0
        for _ in range(20):
            box = fovs.boxes(pose)[:, :1, None]
            points = box[..., 0::2] + rng.random((16, 1, 4, 2)) * (box[..., 1::2] - box[..., 0::2])
            actions = np.zeros((16, 2, 28), dtype=np.float32)
            actions[:, :1] = encode_action(env.scenario, box[..., 0, :], points)
            env.step(actions)
            reported = env.arrays.report_count[:, 0]
            rows = [env.arrays.report_detections[w, 0, c - 4 : c] for w, c in enumerate(reported)]
            stays = np.linalg.norm(np.array(rows) - points[:, 0], axis=-1) < 1e-3
            np.testing.assert_array_equal(fovs.contains(pose, points)[:, 0], stays)
            checked += int(stays.sum())
        assert 0.2 * 1280 < checked < 1280

    @pytest.mark.parametrize("shape", SHAPES)
    def test_samples_are_inside_and_uniform(self, shape: str) -> None:
        _, fovs, pose = self.world(shape)
        draws = np.random.default_rng(2).random((16, 2, 1000, 3))
        points = fovs.sample(pose, draws)
        assert fovs.contains(pose, points).all()
        box = fovs.boxes(pose)
        share = fovs.contains(
            pose, box[..., None, 0::2] + draws[..., :2] * (box[..., None, 1::2] - box[..., None, 0::2])
        )
        # Uniform over the box and kept where contained: the same distribution, by another way.
        kept = box[..., None, 0::2] + draws[..., :2] * (box[..., None, 1::2] - box[..., None, 0::2])
        for k in range(2):
            a = (points - pose[..., None, :2])[0, k]
            b = (kept - pose[..., None, :2])[0, k][share[0, k]]
            spread = 5 * np.hypot(a.std(axis=0) / math.sqrt(len(a)), b.std(axis=0) / math.sqrt(len(b)))
            assert (np.abs(a.mean(axis=0) - b.mean(axis=0)) < spread).all()
            assert (np.abs(a.std(axis=0) / b.std(axis=0) - 1.0) < 0.15).all()

    def test_numbers_by_hand(self) -> None:
        agents = [
            {"role": "adversary", "position": [0, 0], "fov": fov}
            for fov in (
                {"type": "sector", "radius": 10, "heading": 0, "width": math.pi / 2},
                {"type": "polygon", "vertices": [[0, 0], [0, 4], [4, 0]]},
            )
        ]
        fovs = Fovs.of(load_scenario(quiet(agents)), np.arange(2))
        north = np.array([[1.0, 2.0, 0.0, 1.0]] * 2)  # at (1, 2), heading north
        points = np.array(
            [[[1.0, 11.0], [1.0, 12.1], [8.0, 8.9], [8.0, 9.1], [1.0, 2.0], [-1.0, 3.0], [-2.4, 2.5]]]
        )
        assert fovs.contains(north, points).tolist() == [
            [True, False, False, True, True, False, False],
            [False, False, False, False, True, True, True],
        ]
        half = math.sqrt(0.5) * 10
        expected = [[1 - half, 1 + half, 2.0, 12.0], [-3.0, 1.0, 2.0, 6.0]]
        np.testing.assert_allclose(fovs.boxes(north), expected, atol=1e-12)
        centroid = 2 / 3 * 10 * math.sin(math.pi / 4) / (math.pi / 4)
        np.testing.assert_allclose(fovs.middle, [[centroid, 0.0], [4 / 3, 4 / 3]])
        edge = np.array([[[1.0, 11.5]], [[0.9, 4.0]]])  # inside, but for the sector not well inside
        assert fovs.contains(north, edge).tolist() == [[True], [True]]
        assert fovs.contains(north, edge, 0.2).tolist() == [[False], [False]]
